"""Twenty programs in the manner of shop floors: of each the control, its text, and the volume (mm^3) that a cutter of 10 mm
takes from a block of 80 x 60 x 20 mm whose top is z = 0, in closed form."""

from __future__ import annotations

from math import pi

DISC = 25 * pi  # mm^2, of the cutter
ROUND_CORNER = 100 - 25 * pi  # mm^2 that an arc of 10 mm leaves of a square of that side

PROGRAMS: dict[str, tuple[str, float]] = {
    "Fanuc drilling, G83 with pecks": ("""%
O1001 (PLATE, 4 HOLES)
G21 G17 G40 G49 G80 G90
T1 M6
G0 G54 X20. Y15. S2500 M3
G43 H1 Z25. M8
G99 G83 Z-12. R2. Q3. F120.
X60.
Y45.
X20.
G80 M9
G91 G28 Z0.
G28 X0. Y0.
M30
%""", 4 * DISC * 12),
    "Fanuc subprogram called by M98 in increments": ("""%
O0002
G90 G21 G17 G0 X20 Y15 Z5 S3000 M3
M98 P0010 L3
G90 G0 Z50
M30
O0010
G91 G1 Z-7 F100
G90 G1 Y45 F400
G0 Z5
G91 X20 Y-30
G90 M99
%""", 3 * (10 * 30 + DISC) * 2),
    "Fanuc macro B, WHILE over a bolt circle": ("""O0100
G21 G90 G17
#1=40. (X CENTRE)
#2=30.
#3=20. (RADIUS)
#4=6 (HOLES)
#5=0
S2000 M3
G0 Z10.
WHILE [#5 LT #4] DO1
#6=#5*360./#4
G0 X[#1+#3*COS[#6]] Y[#2+#3*SIN[#6]]
G1 Z-3. F100
G0 Z10.
#5=#5+1
END1
M30""", 6 * DISC * 3),
    "Fanuc G41 around a rectangle, D from the tool": ("""O0041
G90 G21 G40 S4000 M3
G0 X-20 Y-20 Z10
Z-4
G41 D1 G1 X10 Y-10 F600
Y50
X70
Y10
X-12
G40 X-20 Y-20
G0 Z50
M30""", 4 * (80 * 60 - 60 * 40 - 3 * ROUND_CORNER)),
    "Fanuc polar G16": ("""O16
G21 G90 G17 G52 X40 Y30
G0 Z10 S2000 M3
G16
G81 X20 Y0 Z-2 R2 F100
Y90
Y180
Y270
G80 G15
G52 X0 Y0
M30""", 4 * DISC * 2),
    "Fanuc G68 rotated slot": ("""O68
G21 G90 G17 S3000 M3
G0 Z10
G68 X40 Y30 R30
G0 X25 Y30
G1 Z-2 F100
X55 F400
G69
G0 Z50
M30""", 2 * (300 + DISC)),
    "Fanuc G51 scaled slot": ("""O51
G21 G90 G17 S3000 M3
G0 X40 Y30 Z10
G51 X40 Y30 Z0 I1.5 J1.5 K1.
G0 X30
G1 Z-2 F100
X50 F400
G50
G0 Z50
M30""", 2 * (300 + DISC)),
    "Haas, inch, helical entry and G13-like circle": ("""%
O00020 (INCH)
G20 G90 G17 G40
T1 M06
G00 G54 X1.5748 Y1.1811 S3500 M03
G43 H01 Z0.5
G01 Z0. F20.
G03 X1.5748 Y1.1811 Z-0.0787 I-0.1969 J0. F15.
G03 I-0.1969 J0.
G00 Z2.
M30
%""", 1.99898 * 100 * pi),
    "Haas, local zero G52 and R arcs": ("""G21 G90
S3000 M3
G52 X10. Y10.
G0 X0 Y0 Z5.
G1 Z-1. F100.
G2 X20. Y20. R20. F400.
G52 X0. Y0.
G0 Z30.
M30""", 20 * pi / 2 * 10 + DISC),
    "Heidenhain, slot with Q parameters and a repeat": ("""0 BEGIN PGM SLOT MM
1 BLK FORM 0.1 Z X+0 Y+0 Z-20
2 BLK FORM 0.2 X+80 Y+60 Z+0
3 TOOL CALL 1 Z S3000
4 Q1 = +20 ; X
5 Q2 = -1
6 L X+Q1 Y+30 Z+5 R0 FMAX M3
7 LBL 1
8 L Z+Q2 F100
9 L X+60 F500
10 L X+Q1
11 Q2 = Q2 - 1
12 CALL LBL 1 REP 2
13 L Z+50 FMAX M30
14 END PGM SLOT MM""", 3 * (400 + DISC)),
    "Heidenhain, RL around a rectangle by APPR LT and DEP LT": ("""0 BEGIN PGM RECT MM
1 TOOL CALL 1 Z S4000
2 L X-30 Y-30 Z+20 R0 FMAX M3
3 L Z-2 FMAX
4 APPR LT X+20 Y+20 LEN25 RL F600
5 L Y+40
6 L X+60
7 L Y+20
8 L X+20
9 DEP LT LEN30 R0
10 L Z+50 FMAX M2
11 END PGM RECT MM""", 2 * (60 * 40 - 40 * 20 - 3 * ROUND_CORNER + 2 * 100)),
    "Heidenhain, circle by CC and C": ("""BEGIN PGM CIRC MM
TOOL CALL 1 Z S4000
L X+60 Y+30 Z+5 R0 FMAX M3
L Z-1 F200
CC X+40 Y+30
C X+60 Y+30 DR+ F400
L Z+50 FMAX M2
END PGM CIRC MM""", 2 * pi * 20 * 10),
    "Siemens, CYCLE83 by MCALL over HOLES2": ("""%_N_HOLES_MPF
N10 G90 G17 G71 T1 D1
N20 S2500 M3 F120
N30 G0 X40 Y30 Z20
N40 MCALL CYCLE81(10,0,2,-5)
N50 HOLES2(40,30,20,0,60,6)
N60 MCALL
N70 G0 Z100
N80 M30""", 6 * DISC * 5),
    "Siemens, R parameters, loop and G42 with G451": ("""N10 G90 G17 G71 G54
N20 T1 D1 S4000 M3
N30 R1=-2 R2=2
N40 G0 X-20 Y-20 Z5
N50 G0 Z=R1
N60 G451 G42 NORM G1 X-10 Y5 F600
N70 X75
N80 Y55
N90 X5
N100 Y-8
N110 G40 X-20 Y-20
N120 G0 Z50
N130 M30""", 2 * (80 * 60 - 70 * 50)),
    "Siemens, TRANS and AROT, arcs with CR": ("""N10 G90 G17 S3000 M3
N20 TRANS X40 Y30
N30 AROT RPL=45
N40 G0 X-15 Y0 Z5
N50 G1 Z-1 F100
N60 X15 F400
N70 TRANS
N80 G0 Z50
N90 M2""", 300 + DISC),
    "Mazak EIA, G10 offsets and G54.1-less zero": ("""%
O2020
G17 G21 G40 G80 G90 G94
G10 L2 P1 X10. Y10. Z0.
G54
T01 T00 M6
S3000 M3
G0 X10. Y20. Z10.
G1 Z-1.5 F150.
X50. F500.
G0 Z100.
M30
%""", 1.5 * (400 + DISC)),
    "LinuxCNC, o-words and named parameters": ("""o<pass> sub
G1 Z#1 F100
G1 X60 F500
G0 Z5
G0 X20
o<pass> endsub
G21 G90 G64 P0.01
S3000 M3
G0 X20 Y30 Z5
#<depth> = 0
o100 while [#<depth> GT -3]
#<depth> = [#<depth> - 1]
o<pass> call [#<depth>]
o100 endwhile
M2""", 3 * (400 + DISC)),
    "LinuxCNC, G41.1 with the diameter in D": ("""G21 G90 G17 G40
S3000 M3
G0 X30 Y-30 Z5
G0 Z-1
G41.1 D20 G1 X30 Y-10 F500
Y70
G40 X-40 Y80
G0 Z20
M2""", 10 * 60),
    "Mach3, spiral ramp by helices": ("""G21 G90 G17
M3 S3000
G0 X50 Y30 Z1
G1 Z0 F100
G2 X50 Y30 Z-1 I-10 J0 F300
G2 X50 Y30 Z-2 I-10 J0
G2 X50 Y30 I-10 J0
G0 Z20
M5 M30""", 2 * (2 * pi * 10 * 10)),
    "GRBL, relative moves and comments": ("""; made for a small router
G21
G90
M3 S10000
G0 Z5.000
G0 X20.000 Y20.000
G1 Z-1.000 F60
G91
G1 X30.000 F300
G1 Y20.000
G90
G0 Z5.000
M5""", 50 * 10 - 25 + 1.25 * DISC),
}
