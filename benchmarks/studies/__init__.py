"""The studies of Lamata et al. (2014): each writes its table and its figure."""
