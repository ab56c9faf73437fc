"""Results: runs of the engine from their check to their end, what is made of a result, and how it is handed on."""
