"""Smoke after its clip: continued, retimed, looped, and made to react to wind, turbulence, fans and obstacles."""
