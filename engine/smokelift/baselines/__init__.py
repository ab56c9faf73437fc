"""The paper's own method, part by part, for comparison."""
