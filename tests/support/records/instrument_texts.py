"""The same two channels as text of many instruments, after the forms that these write: only the
numbers are made up."""

from __future__ import annotations

import numpy as np

RATE_HZ, START_S, SAMPLES = 100_000.0, -0.005, 240
STEP_S = 1 / RATE_HZ


def signals() -> tuple[np.ndarray, np.ndarray]:
    """A half sine and its half, in volts of four decimals (240,)."""
    first = np.round(
        3.8735 * np.sin(np.pi * np.arange(SAMPLES) / 60) * (np.arange(SAMPLES) < 60), 4
    )
    return first, np.round(first / 2, 4)


def _rows(form: str, *columns: np.ndarray, decimal: str = ".") -> str:
    lines = (form.format(*row) for row in zip(*columns, strict=True))
    return "".join((line.replace(".", ",") if decimal == "," else line) + "\n" for line in lines)


_COUNT = np.arange(SAMPLES)
_TIME = START_S + STEP_S * _COUNT
_A, _B = signals()

RIGOL = "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-5.000000e-03,1.000000e-05\n" + _rows(
    "{:d},{:.4e},{:.4e},", _COUNT, _A, _B
)
#: The screen shows a part: the numbers begin with sample 22.
RIGOL_PART = (
    RIGOL.split("\n", 2)[0]
    + "\n"
    + RIGOL.split("\n", 2)[1]
    + "\n"
    + "".join(line + "\n" for line in RIGOL.splitlines()[24:])
)
RIGOL_MSO5000 = "CH1V,CH2V,t0 =-5.000000e-03, tInc = 1.000000e-05,\n" + _rows(
    "{:.4e},{:.4e},,", _A, _B
)
RIGOL_DS1000 = "X,CH1,CH2,\nSecond,Volt,Volt,\n" + _rows("{:.7e},{:.5e},{:.5e},", _TIME, _A, _B)
RIGOL_DS1000B = ",CH1,CH2\nSecond,Volt,Volt\n" + _rows("{:.5e},{:.4e},{:.4e}, ", _TIME, _A, _B)
RIGOL_ULTRASCOPE = "X,CH1 (V),CH2 (V)\n" + _rows("{:.8f},{:.4f},{:.4f}", _TIME, _A, _B)
RIGOL_SETTINGS = (
    f'"Number of Data points =",{SAMPLES},\n"Time Scale (s/DIV) =",1E-7,\n"Time Delay (s) =",0,\n'
    '"Sampling Frequency (Hz)=",100000,\n"Trigger Mode = ",0,\n"Trigger '
    'Source = ",1,\n"Channel Data","CH1","CH2"\n'
    '"Attenuation = ",10,1\n"Pos (V) = ",0.2,-6\n"Scale (V/DIV) = '
    '",0.1,2\n"Inverted = ","NO","NO"\n'
    '"Time (s)","Voltage (V)","Voltage (V)"\n'
    + _rows("{:.6g},{:.4f},{:.4f}", _TIME, _A, _B)
    + ",,\n"
)
KEYSIGHT = "x-axis,1,2\nsecond,Volt,Volt\n" + _rows("{:.9E},{:+.6E},{:+.6E}", _TIME, _A, _B)
SIGLENT = (
    f"Record Length,Analog:{SAMPLES}\nSample "
    f"Interval,Analog:1.000000E-05\nVertical Units,CH1:V, CH2:V\n"
    "Vertical Scale,CH1:1.00, CH2:0.50\nVertical Offset,CH1:-2.00, CH2:0.00\nHorizontal Units,S\n"
    "Horizontal Scale,0.0001\nModel Number,SDS1104X-E\nSerial "
    "Number,SDS0\nSource,CH1,CH2\nSecond,Value,Value\n"
    + _rows("{:.8f},{:.5f},{:.5f}", _TIME, _A, _B)
)
#: Of the older software: one channel, without a line of names.
SIGLENT_OLD = (
    f"Record Length,Analog:{SAMPLES}\nSample Rate,100000.0\nVertical "
    f"Scale,CH1: 1.00\nVertical Offset,CH1:0.00000\n"
    "Horizontal Scale, 0.000100000\nSecond,Volt\n" + _rows("{:.11f},{:.5f}", _TIME, _A)
)
YOKOGAWA = (
    '"Header Size",16\n"Model '
    'Name","DLM3000"\n"Comment",""\n"BlockNumber",1\n"TraceName","CH1","CH2"\n'
    f'"BlockSize",{SAMPLES},{SAMPLES}\n"VUnit","V","V"\n"SampleRate",1.000000E+05,1.000000E+05\n'
    '"HResolution",1.000000E-05,1.000000E-05\n"HOffset",-5.000000E-03,-5.000000E-03\n'
    '"HUnit","s","s"\n'
    f'"DisplayBlockSize",{SAMPLES},{SAMPLES}\n"DisplayPointNo.",1,1\n"Date",2026/03/02,2026/03/02\n'
    '"Time",12:00:00.00000000,12:00:00.00000000\n\n' + _rows(",{:.5E},{:.5E},", _A, _B)
)
HIOKI = (
    '"COMMENT","shot '
    '1"\n"DATE","03-02-2026"\n"TIME","12:00:00"\n"NUM_SIGS",3\n"INTERVAL",1.000E-05\n'
    '"HORZ_UNITS","S"\n"VERT_UNITS","S","V","V"\n"SIGNAL","TIME","CH1","CH2"\n"DATA"\n'
    + _rows("{:+.4E},{:+.4E},{:+.4E}", _TIME, _A, _B)
)
HIOKI_CSV = (
    '"File name","MEMDATA.CSV","V 1.0"\n"Title comment","shot"\n"Trigger '
    'Time","\'26-03-02 12:00:00.00"\n'
    '"Ch","A 1- 1","A 1- 2"\n"Mode","ANALOG","ANALOG"\n"Range","5V","5V"\n"Scaling","Off","On"\n'
    '"Ratio"," 1.00000E+00"," 2.00000E+00"\n"Offset"," 0.00000E+00"," '
    '1.00000E-01"\n"Time","CH1[V]","CH2[V]"\n' + _rows("{: .9E},{: .5E},{: .5E}", _TIME, _A, _B)
)
RTB = "in s,CH1 in V,CH2 in V\n" + _rows("{:.7E},{:.7E},{:.7E}", _TIME, _A, _B)
PICOSCOPE = "Time,CH1,CH2\n(ms),(V),(V)\n\n" + _rows("{:.8f},{:.8f},{:.8f}", 1e3 * _TIME, _A, _B)
LECROY = (
    f"LECROYWS3024,00001,Waveform\nSegments,1,SegmentSize,{SAMPLES}\n"
    "Segment,TrigTime,TimeSinceSegment1\n"
    "#1,02-Mar-2026 12:00:00,0\nTime,Ampl\n" + _rows("{:.8e},{:.5e}", _TIME, _A)
)
CATMAN = (
    "HBM_CATMAN_DATAFILE_40\nDate 02.03.2026\n\nTime  1 - default sample rate\tCH1\tCH2\ns\tV\tV\n"
    + _rows("{:.6f}\t{:.4f}\t{:.4f}", _TIME, _A, _B, decimal=",")
)
DEWESOFT = (
    "File name: shot_0001.d7d\nStart time: 3/2/2026 12:00:00.000\nNumber of "
    "channels: 2\nSample rate: 100000\n"
    "Store type: always fast\n\nTime (s)\tCH1 (V)\tCH2 (V)\n"
    + _rows("{:.6f}\t{:.4f}\t{:.4f}", _TIME, _A, _B)
)
DIGILENT = (
    f"#Digilent WaveForms Oscilloscope Acquisition\n#Sample rate: 100000Hz\n#Samples: {SAMPLES}\n"
    "#Trigger: Source: Channel 1 Type: Edge Condition: Rising Level: 100 mV "
    "Hyst.: Auto HoldOff: 0 s\n"
    "#CH1 Range: 5 V Offset: 0 V\n\nTime (s),CH1 (V),CH2 (V)\n"
    + _rows("{!r},{!r},{!r}", *map(np.ndarray.tolist, (_TIME, _A, _B)))
)
#: The header of an RTO, and its numbers in a file beside it.
RTO_HEADER = (
    "Type:RTO\nResolution:1e-05:\nRecordLength:240:\nXStart:-0.005:\nXStop:-0.0026:\nSource:CH1:\n"
    "BaseUnit:V:\n"
    "MultiChannelExport:On:\nMultiChannelSource:CH1:CH2:\nSignalResolution:1e-05:\n"
    "SignalRecordLength:240:\n"
    "HardwareXStart:-0.005:\nHardwareXStop:-0.0026:\nSignalHardwareRecordLength:240:\n"
    "VerticalScale:0.5:\n"
    "VerticalOffset:0:\nTimestampState:Off:\nNumberOfAcquisitions:1:\n"
)
RTO_NUMBERS = _rows("{:.6g},{:.6g}", _A, _B)

#: Name -> text. All say CH1 and CH2 (a few CH1 alone) in V at 100 kHz from -5 ms.
TEXTS: dict[str, str] = {
    "rigol": RIGOL,
    "rigol-mso5000": RIGOL_MSO5000,
    "rigol-ds1000": RIGOL_DS1000,
    "rigol-ds1000b": RIGOL_DS1000B,
    "rigol-ultrascope": RIGOL_ULTRASCOPE,
    "rigol-settings": RIGOL_SETTINGS,
    "keysight": KEYSIGHT,
    "siglent": SIGLENT,
    "siglent-old": SIGLENT_OLD,
    "yokogawa": YOKOGAWA,
    "hioki": HIOKI,
    "hioki-csv": HIOKI_CSV,
    "rohde-schwarz-rtb": RTB,
    "picoscope": PICOSCOPE,
    "lecroy": LECROY,
    "catman": CATMAN,
    "dewesoft": DEWESOFT,
    "digilent": DIGILENT,
}
#: What a file of the instrument calls the channels otherwise, and their unit where it says none.
NAMES = {"keysight": ("1", "2"), "lecroy": ("Ampl",)}
UNITS = {"lecroy": None}
