"""The survey report (`moma survey-report`)."""
