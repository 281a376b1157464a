"""Assessment of a scene: how far it is from falling under each load, and how it would fall.

Public: `Assessment`, `assess` (assess); `Answer`, `answer` (answers); `parse_question`, `scene_questions` (questions).
"""
