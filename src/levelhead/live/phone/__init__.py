"""A phone as a live source: a page that streams its motion, and the formats in which its apps send theirs.

Data flows one way: ``server`` takes messages, ``messages`` makes them readings of one sensor each, ``streams`` joins
these into samples, and a node starts ``source``. ``phyphox`` asks the phone instead.
"""
