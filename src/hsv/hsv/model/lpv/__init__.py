"""Linear parameter-varying models: discretisation, polytopes, scheduling weights."""
