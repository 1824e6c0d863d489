"""Recordings and plans as streams of joint states, from any kind of file."""
