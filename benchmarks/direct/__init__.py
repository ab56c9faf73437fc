"""Continued, retimed and looped smoke beside what really came."""
