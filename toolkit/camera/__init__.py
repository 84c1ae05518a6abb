"""What a camera does to light, one file an effect. Only the effects that a scene names are applied."""
