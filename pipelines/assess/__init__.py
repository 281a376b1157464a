"""Questions to a scene: how far it is from falling, and how far its movement explains what was measured.

Public: `Assessment`, `AssessOptions`, `assess` (assess); `Answer`, `answer` (answers); `parse_question`,
`scene_questions` (questions); `SurveyComparison`, `compare` (compare).
"""
