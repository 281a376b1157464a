"""The ground that all packages stand on; it imports none of them.

errors   what fails, with exit code and remedy
tables   rows and columns of texts and workbooks
kernels  compiled kernels, loaded before numba
settings meaning, unit and bounds of a dataclass field
toml     files of TOML, checked by settings, with the line of what is wrong
units    units in SI, and gravity
polygons area and centroid of a plane polygon in space
statistics robust scale, scatter of differences, roots of falling functions

Public: `DatabaseError`, `ExchangeError`, `GeometryError`, `MeshError`, `MissingLibraryError`, `MomaError`,
`NoDatabaseError`, `QueryError`, `SceneError`, `SolverError`, `StorageError`, `SurveyError`,
`UnsoundSceneError`, `UsageError`, `missing_library`, `storage_error`,
`storing` (errors); `Setting`, `declared` (settings);
`area_and_centroid` (polygons);
`CENTI`, `DECI`, `FOOT`, `GIGA`, `GRAVITY`, `INCH`, `KILO`, `LENGTHS`, `MEGA`, `MILLI`, `POUND`, `PSI`,
`SURVEY_FOOT` (units).
"""
