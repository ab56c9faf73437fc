"""The interface: the tab with its buttons and sub-panels, the settings by subject, preferences and presets."""
