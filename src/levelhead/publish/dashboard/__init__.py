"""A page in the browser: the body in 3-D, angles with their two_sigma beside the raw sensors, bias, events, sliders.

``levelhead view LOG`` plays a recording, ``levelhead view --live`` follows a node. The page comes from this machine
alone: viser's server listens on 127.0.0.1, and nothing is fetched from elsewhere.
"""
