"""The symptoms of a fused track that ``explain`` looks for: each is one file and one entry of ``ALL``."""

from levelhead.inspection.symptoms.drift import DRIFT
from levelhead.inspection.symptoms.jitter import JITTER
from levelhead.inspection.symptoms.jump import JUMP
from levelhead.inspection.symptoms.lag import LAG
from levelhead.inspection.symptoms.missing import MISSING

ALL = (MISSING, JUMP, DRIFT, JITTER, LAG)  # in the order of a report
