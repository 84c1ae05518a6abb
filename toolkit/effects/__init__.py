"""Physics, one file an effect. A scene names the effects that act; only those are imported."""
