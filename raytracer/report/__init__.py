"""One page about a folder of scenes: every picture, the charts, the tables, and where the methods go wrong."""
