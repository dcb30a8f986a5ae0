"""Serial arms: their frames and their inverse solutions."""
