"""Studies of finite-element bodies and of machines made of them."""
