"""Data gloves: from sensor readings to joint angles (Wang & Neff 2013).

A glove's sensors measure rotations of a hand (`gloves`, `definitions`, `hands`).
Several sensors may answer to one rotation (`examine` finds which). Samples are readings
with rotations that are known (`samples`): from key poses and widgets (FK, good for
every wearer), from touching fingertips (IK, `touch`) or from markers recorded with it
(`streams`). A model per rotation is learnt from them (`models`, `calibrate`) and gives
mean and variance (`calibration`). A glove that was taken off and is donned again reads
a little differently (`donning`).
"""
