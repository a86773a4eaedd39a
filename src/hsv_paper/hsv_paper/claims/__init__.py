"""The paper's checkable statements, measured: one module a part of the paper."""
