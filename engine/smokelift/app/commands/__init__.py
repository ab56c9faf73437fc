"""What the commands do and take: a module for those that are alike."""
