"""Prior odds and margins, all that decide between two understandings of a log: natural logarithms, of odds or of how
many times likelier all readings are. What a smaller margin lets in, or a larger one misses, is beside each; the rows of
`tests.bench ablation` say what the rules are worth that use them."""

# Prior log-odds
FAULT = -6.0  # of a fault that lasts, or of a patch that was followed, at a jump: what explains one must gain more
STAYS = -4.0  # of a step that stays or a clock that jumps, to a patch: where one begins slowly is uncertain
MOTION = 8.0  # of motion, to a patch, for rejected readings that leave the track and join it again without a jump

START = 40.0  # nine numbers of a state, which a start takes from the readings themselves

# Margins
REFUTED = 0.5  # one standard deviation: by which a parameter may be less likely than its likeliest value
POSSIBLE = 3.0  # a ratio of 20: what is less likely by no more is not excluded, what is likelier by more counts
LIKELIER = 5.0  # decisions on some readings; within it, either may be, and the verdict says so
SURE = 8.0  # what bends a track or widens its sigmas: correlated noise, another motion, a step, a patch; with less the
# luck of a single flight decides
OPEN = 12.0  # within which a jump may be one fault or another: beside agile targets it tells little
MANY = 15.0  # what moves half of a log, or concerns all of its readings
ONE_END = 25.0  # a patch that motion explains but for an end: starts and turns gain 21 without one, missed patches 43
ANEW = 100.0  # decisions on a whole log that were made from another start: 120 and more at turns that were screened
# out, up to 75 at take-offs and patches that resemble noise that has grown
HOPELESS = 200.0  # what is behind by more is not followed up

# Margins for each reading
FEW_ANEW = 0.2  # for ANEW, where that is less: rockets that burn for some of 31 to 55 rows gain 0.3 to 1.3
COSTS = (
    3.0  # what a more agile target costs where its track is lost in the end; patches cost up to 6, but seem no more so
)
PERFECT = 20.0  # the most that a fault gains: where it is more, the track without it was lost
LOST = 90.0  # of those left out, beyond what goes with them: where the track is lost for want of them
