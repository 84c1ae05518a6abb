"""What tracking a bob is made of: the search, following it, the string, the still background, the shake, the swing."""
