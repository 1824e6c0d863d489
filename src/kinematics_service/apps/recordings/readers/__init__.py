"""Read recordings and plans of any file type as streams of joint states."""
