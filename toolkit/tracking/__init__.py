"""What tracking a bob is made of: `begin`, then `follow` frame by frame, then the whole `clip`; on what a `picture` shows and `geometry`."""
