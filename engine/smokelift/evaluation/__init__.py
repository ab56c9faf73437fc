"""How near a result is to the truth: metrics, scores and charts."""
