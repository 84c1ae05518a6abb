"""From the frames read ahead: where the bob is, how it looks, how it is best measured."""
