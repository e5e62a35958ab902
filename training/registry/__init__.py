"""The registry of models: the only folder that speaks MLflow."""
