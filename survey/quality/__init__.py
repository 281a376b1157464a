"""Quality of a survey: precision, courses, contradictions, points to measure again.

Public: `appraise`, `judge_survey`, `StoneQuality`, `SurveyQuality` (precision); `facades_of`, `find_facades`,
`Facade` (facades); `measure_courses`, `course_heights`, `with_scatter`, `CourseLine` (courses);
`contradictions`, `Contradiction` (contradictions);
`misplaced_corners`, `SeenFace` (corners);
`standards`, `deviations` (canon); `wedges`, `sloped_side` (wedges); `list_remeasures`, `Remeasure` (remeasure);
`compare_courses`, `compare_plumb`, `CourseMovement`, `PlumbMovement` (movement).
"""
