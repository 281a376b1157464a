"""Report on survey files (`moma survey-report`).

Public: `report_surveys`, `SurveyReport` (report); `study_surveys`, `SurveyStudy` (study); `write_survey_page` (page);
`survey_json`, `write_survey_json` (document).
"""
