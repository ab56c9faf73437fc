"""How well the background of a clip and the smoke before it are found, on clips whose background is known."""
