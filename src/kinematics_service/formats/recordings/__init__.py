"""Recordings and plans as streams of joint states, whatever kind of file they come in."""
