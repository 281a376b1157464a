"""Recording of knowledge from TOML files (`moma record`)."""
