"""The track in space and on a map, with ticks of time and a grid of latitude and longitude."""
