"""The paper's study: its figures, its claims, and what they are sensitive to."""
