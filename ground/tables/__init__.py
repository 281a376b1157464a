"""Tables of any source: rows, separators, decimal marks, encodings, sheets, and columns by name with their units.

Public: `Table`, `read_table` (table); `ListRows`, `Row`, `TextRows`, `open_rows` (rows); `NumberStream`,
`open_numbers` (number_stream); `TextLines` (text_lines); `Decimals` (decimals); `COORDINATES`, `places_of`
(columns); `parse_length`, `parse_number` (numbers); `Layer`, `write_geopackage` (geopackage);
`exchanged_grid` (grids).
"""
