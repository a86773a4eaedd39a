"""The paper's checkable statements: measured, judged, and written as a page."""
