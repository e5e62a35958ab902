"""Text as oscilloscopes export it, after files that can be found in public: only the numbers are
made up."""

from __future__ import annotations

#: Tektronix MDO, MSO, DPO: settings above the columns, here of one analog and two digital channels.
MDO3014 = """\
Model,MDO3014
Firmware Version,1.20

Waveform Type,ANALOG,,Waveform Type,DIGITAL,
Point Format,Y,,Point Format,Y,
Horizontal Units,s,,Horizontal Units,s,
Horizontal Scale,0.004,,Horizontal Scale,0.004,
Horizontal Delay,0.019528,,,,
Sample Interval,4e-09,,Sample Interval,4e-09,
Record Length,4,,Record Length,4,
Gating,0.0% to 100.0%,,Gating,0.0% to 100.0%,
Probe Attenuation,10,,,,
Vertical Units,V,,Vertical Units,V,V
Vertical Offset,0,,Threshold Used,1.65,1.65
Vertical Scale,2,,,,
,,,,,
Label,PCLK,,Label,FV,LV
TIME,CH1,,TIME,D11,D10
-4.720000e-04,0.68,,-4.720000e-04,0,1
-4.719960e-04,0.28,,-4.719960e-04,1,0
-4.719920e-04,0.2,,-4.719920e-04,0,0
-4.719880e-04,-1.32,,-4.719880e-04,0,1
"""
MSO58 = """\
Model,MSO58
Firmware Version,2.0.3

Waveform Type,ANALOG,ANALOG
Point Format,Y,Y
Horizontal Units,s,s
Sample Interval,1e-06,1e-06
Record Length,5,5
Vertical Units,V,A
Label,SDA,IOUT
,,
TIME,CH1,CH2,
-2.000000e-06,0.01,1.5,
-1.000000e-06,3.29,1.6,
0.000000e+00,3.31,1.7,
1.000000e-06,0.02,1.8,
2.000000e-06,0.00,1.9,
"""
#: Tektronix TDS 1000 and 2000: one channel a file, settings in the first three columns.
TDS2014 = """\
Record Length,2.000000e+01,,  -0.000500000000,  0.00000,
Sample Interval,4.000000e-07,,  -0.000499600000,  0.02000,
Trigger Point,1.000000000000e+01,,  -0.000499200000,  0.04000,
,,,  -0.000498800000,  0.06000,
,,,  -0.000498400000,  0.04000,
,,,  -0.000498000000,  0.02000,
Source,CH1,,  -0.000497600000,  0.00000,
Vertical Units,V,,  -0.000497200000,  -0.02000,
Vertical Scale,5.000000e-02,,  -0.000496800000,  0.00000,
Vertical Offset,0.000000e+00,,  -0.000496400000,  0.00000,
Horizontal Units,s,,  -0.000496000000,  0.00000,
Horizontal Scale,1.000000e-04,,  -0.000495600000,  0.00000,
Pt Fmt,Y,,  -0.000495200000,  0.00000,
Yzero,0.000000e+00,,  -0.000494800000,  0.00000,
Probe Atten,1.000000e+00,,  -0.000494400000,  0.00000,
Model Number,TDS2014,,  -0.000494000000,  0.00000,
Serial Number,C012345,,  -0.000493600000,  0.00000,
Firmware Version,FV:v2.11,,  -0.000493200000,  0.00000,
,,,  -0.000492800000,  0.00000,
,,,  -0.000492400000,  0.00000,
"""
#: Tektronix TDS 500: quoted, without a delimiter at the end, times of nine digits.
TDS500 = """\
"Record Length",4,"Points",-6.24000008e-008,-0.00800000069
"Sample Interval",1.60000002e-009,s,-6.08000008e-008,-0.00800000069
"Trigger Point",39,"Samples",-5.92000008e-008,-0.00800000069
"Source","CH2",,-5.76000008e-008,0.016
"""
#: PicoScope 6 and 7: names, units, an empty line; a voltage beyond the range is an infinity.
PICO = "Time,Channel A,Channel B\n(ms),(V),(mV)\n\n{}"
PICO_ROWS = "-0.10000000,4.82528200,-15.90\n-0.09000000,∞,-3.98\n-0.08000000,-4.80422400,-∞\n"
#: GW Instek GDS: settings, then values alone, each with a delimiter behind it.
GDS = """\
Memory Length,3,
Vertical Units,V,
Sampling Period,4.00000e-06,
Firmware,V1.09,
Time,
Waveform Data,
1,
2,
3,
"""
