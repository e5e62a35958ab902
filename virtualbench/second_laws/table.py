"""Which laws there are: one row for each effect and split, with what is different about it and
where it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

SPLITS = ("development", "calibration", "sealed")


@dataclass(frozen=True)
class SecondLaw:
    """`high`: the largest strength that is physical, in the law's own unit; `low` below 0: either
    sign. `owner`: what has a value of its own: "bullet", "tip", "face", "mode", "channel"; empty
    where one value serves all."""

    effect: str
    split: str
    low: float
    high: float
    owner: str
    text: str
    source: str


#: The fields of a `SecondLaw` without its split.
_LawRow = tuple[str, float, float, str, str, str]

_DEVELOPMENT: tuple[_LawRow, ...] = (
    ("gun.back_pressure", 0.9, 1.04, "",
     "the air ahead is a rigid column that the projectile pushes: "
     "its mass is added, and its outflow takes a head",
     "Wylie and Streeter, Fluid Transients (1978), ch. 3, rigid column theory"),
    ("gun.blow_by", 0.0, 6.0, "bullet",
     "isothermal flow with wall friction through a narrow ring, whose width is the bullet's own",
     "Shapiro, Compressible Fluid Flow I (1953), ch. 6; friction: "
     "Hirs, J. Lubr. Technol. 95 (1973) 137"),
    ("gun.valve_flow", 0.0, 2.0, "",
     "a control valve with an expansion factor that opens along a straight line",
     "IEC 60534-2-1:2011, compressible fluids; x_T of full-bore ball valves, table D.2"),
    ("gun.barrel_loss", 0.0, 40.0, "",
     "a fully rough wall, on gas whose speed grows evenly from the breech to the projectile",
     "von Karman's rough pipe: White, Fluid Mechanics, ch. 6; profile: "
     "Corner, Interior Ballistics (1950), ch. 8"),
    ("gun.sliding_friction", 0.0, 15.0, "bullet",
     "shear of the lubricant's film under a seal, as the root of speed times contact pressure",
     "Mueller and Nau, Fluid Sealing Technology (1998), ch. 3, inverse hydrodynamic theory"),
    ("gun.heat_exchange", 0.0, 300.0, "",
     "turbulent convection in the bore, a coefficient that grows with speed",
     "Dittus and Boelter (1930): Incropera and DeWitt, Fundamentals of Heat and Mass Transfer, "
     "ch. 8"),
    ("gun.dead_volume", 0.0, 8.0, "",
     "a volume whose walls hold the gas that fills it near their temperature",
     "Moran and Shapiro, Fundamentals of Engineering Thermodynamics, section 4.12, "
     "filling with heat transfer"),
    ("contact.viscous_loss", 0.0, 20.0, "tip",
     "F = K (d^1.5 + 1.5 A d^0.5 d'), A of the tip's material",
     "Kuwabara and Kono, Jpn. J. Appl. Phys. 26 (1987) 1230; "
     "Brilliantov et al., Phys. Rev. E 53 (1996) 5382"),
    ("contact.plastic_yield", 0.0, 8.0, "tip",
     "Meyer's law with the hardening of the softer material beyond yield, elastic back",
     "Tabor, The Hardness of Metals (1951), ch. 1 and 7; unloading: "
     "Stronge, Impact Mechanics (2000), ch. 6"),
    ("contact.layer_compliance", 0.0, 4.0, "tip",
     "a foamed sheet that densifies, under an area that is the tip's own",
     "Gibson and Ashby, Cellular Solids (1997), ch. 5, densification"),
    ("contact.plate_compliance", 0.0, 2.0, "face",
     "far field of the plate and, before it, the local give of its surface with a loss",
     "Ljunggren, J. Sound Vib. 90 (1983) 559, near field of a point force; "
     "Cremer and Heckl, section 5.4"),
    ("contact.effective_mass", -20.0, 25.0, "tip",
     "tips of other density than the one that was weighed: an error of mass by tip material",
     "PCB 086 series, extender masses and tips: mass changes with the tip (manufacturer's manual)"),
    ("contact.tip_geometry", 0.0, 30.0, "tip",
     "a ball with a flat worn onto it, by tip material",
     "Popov, Hess and Willert, Handbook of Contact Mechanics (2019), section 2.5, "
     "truncated paraboloid"),
    ("plate.damping", -8.0, 30.0, "mode",
     "Rayleigh's: a part that falls with frequency and one that grows with it",
     "Rayleigh, Theory of Sound I, section 102; Caughey, J. Appl. Mech. 27 (1960) 269"),
    ("plate.stiffness", -8.0, 8.0, "mode",
     "another thickness, whose shear takes back more the higher the mode",
     "Mindlin, J. Appl. Mech. 18 (1951) 31"),
    ("plate.sensor_mass", 0.0, 0.3, "mode",
     "sensors on soft mounts: each mode feels the dynamic mass m / (1 - (f / f_m)^2)",
     "Ewins, Modal Testing (2000), section 3.3; ISO 5348:2021, mass loading"),
    ("plate.boundary", 0.0, 200.0, "mode",
     "pads that are stiff and lossy, felt by each mode as it moves there",
     "Nashif, Jones and Henderson, Vibration Damping (1985), ch. 6; Rayleigh's quotient"),
    ("sensor.pressure_offset", -0.15, 0.15, "",
     "an error of zero at a true full scale: it falls evenly to nothing at 4 bar",
     "IEC 61298-2:2008, terminal-based errors"),
    ("sensor.pressure_gain", -0.3, 0.3, "",
     "an error of linearity: a gain that grows with pressure",
     "IEC 61298-2:2008, conformity error"),
    ("sensor.velocity_gain", -0.15, 0.15, "",
     "a timer that starts late: the error of a velocity grows with it",
     "Doebelin, Measurement Systems (2003), ch. 4.3, time of flight"),
    ("sensor.force_gain", -0.3, 0.3, "",
     "an error of linearity: a gain that grows with force",
     "ISO 376:2011, interpolation error of force-proving instruments"),
    ("sensor.force_bandwidth", 0.0, 25.0, "",
     "Bessel's low pass of four poles",
     "Thomson, Proc. IEE 96 (1949) 487"),
    ("sensor.acceleration_gain", -0.3, 0.4, "",
     "a sensitivity that falls evenly with the logarithm of frequency",
     "Serridge and Licht, Piezoelectric Accelerometers (1987), ch. 2, "
     "charge sensitivity of ceramics"),
    ("sensor.mount_resonance", 0.0, 5.0, "",
     "a mounting with much damping, as wax and adhesive have",
     "ISO 5348:2021, on wax and adhesives"),
    ("sensor.zero_shift", -0.05, 0.05, "",
     "an offset at the shock's peak that decays fast at first and then slowly",
     "Harris' Shock and Vibration Handbook, 6th ed. (2010), on zero shift; two relaxations: "
     "Lakes (2009), ch. 2"),
)  # fmt: skip

_CALIBRATION: tuple[_LawRow, ...] = (
    ("gun.back_pressure", 0.9, 1.04, "",
     "the air ahead is compressed, as a sound absorber lets it out of the muzzle slowly",
     "Moran and Shapiro, Fundamentals of Engineering Thermodynamics, section 4.12; outflow: "
     "ISO 6358-1:2013"),
    ("gun.blow_by", 0.0, 6.0, "bullet",
     "a lip that the gas lifts: the gap grows with pressure, and the flow through it is a nozzle's",
     "Mueller and Nau, Fluid Sealing Technology (1998), on elastic lips; flow: "
     "Saint-Venant and Wantzel (1839)"),
    ("gun.valve_flow", 0.0, 2.0, "",
     "a poppet that the tank's pressure throws open, so that high pressures open it sooner",
     "Beater, Pneumatic Drives (2007), on poppet valves; flow: ISO 6358-1:2013, b = 0.25"),
    ("gun.barrel_loss", 0.0, 40.0, "",
     "a smooth wall in the bore and the line before it: friction falls with Reynolds' number",
     "Blasius, Forsch. Ing.-Wes. 131 (1913); White, Fluid Mechanics, ch. 6"),
    ("gun.sliding_friction", 0.0, 15.0, "bullet",
     "a rubber seal that the gas presses on the bore, with the power 2/3 of its load",
     "Schallamach, Proc. Phys. Soc. B 65 (1952) 657, load dependence of rubber friction"),
    ("gun.heat_exchange", 0.0, 300.0, "",
     "natural convection from wires in the tank, a film that grows with density and with the "
     "difference itself",
     "Reynolds and Kays, Trans. ASME 80 (1958) 1160, blowdown of receivers; wires: "
     "ISO 6358-2:2013"),
    ("gun.dead_volume", 0.0, 5.0, "",
     "a hose that widens with pressure, and stores the gas's work in its wall",
     "ISO 6801:1983, volumetric expansion of hoses; "
     "Moran and Shapiro, section 2.2, work of expansion"),
    ("contact.viscous_loss", 0.0, 5.0, "tip",
     "a ball on a linear damper, whose loss falls with speed, by the tip's material",
     "Schaefer, Dippel and Wolf, J. Phys. I France 6 (1996) 5, "
     "Hertz's spring with a linear dashpot"),
    ("contact.plastic_yield", 0.0, 8.0, "tip",
     "a cavity that expands in a material whose strength grows with the rate of strain",
     "Johnson, Contact Mechanics (1985), section 6.3; Cowper and Symonds: "
     "Jones, Structural Impact (1989), ch. 8"),
    ("contact.layer_compliance", 0.0, 4.0, "",
     "a thin sheet that is pressed like a bed of springs, an indentation as the root of force",
     "Johnson, Contact Mechanics (1985), section 5.8, thin bonded layers"),
    ("contact.plate_compliance", 0.0, 2.0, "",
     "a point near a free edge, which slow pulses feel",
     "Cremer, Heckl and Petersson, Structure-Borne Sound (2005), ch. 5, "
     "impedance of plates at an edge"),
    ("contact.effective_mass", 0.0, 60.0, "",
     "a mass in a slack joint that rubs: its push is as large as its dry friction, "
     "whatever the blow",
     "Iwan, J. Appl. Mech. 33 (1966) 893, Jenkins' element"),
    ("contact.tip_geometry", 0.0, 30.0, "tip",
     "a ball whose crown is worn smoothly, by tip material",
     "Steuermann (1939) and Johnson, Contact Mechanics (1985), section 5.3; any profile: "
     "Sneddon (1965)"),
    ("plate.damping", -8.0, 60.0, "mode",
     "sound that the plate radiates, most at the frequency of coincidence",
     "Cremer, Heckl and Petersson, Structure-Borne Sound (2005), ch. 6; "
     "Leppington et al., Proc. R. Soc. A 382 (1982)"),
    ("plate.stiffness", -8.0, 8.0, "mode",
     "a modulus that relaxes, and grows with the logarithm of frequency",
     "Lakes, Viscoelastic Materials (2009), ch. 3, Kramers and Kronig's relation of an even loss"),
    ("plate.sensor_mass", 0.0, 0.3, "mode",
     "sensors on wide blocks: short waves feel their mean over the block's area alone",
     "Fahy and Gardonio, Sound and Structural Vibration (2007), on averages over a disc"),
    ("plate.boundary", 0.0, 200.0, "mode",
     "a foam under all of the plate whose stiffness grows with frequency, with its loss",
     "Pritz, J. Sound Vib. 195 (1996) 103, fractional derivative model of foams and rubbers"),
    ("sensor.pressure_offset", -0.1, 0.1, "",
     "gas shut in behind the diaphragm: an error of zero that grows as it is compressed",
     "Doebelin, Measurement Systems (2003), ch. 6, references of gauge transducers; Boyle's law"),
    ("sensor.pressure_gain", -0.3, 0.3, "",
     "a diaphragm that stiffens by its stretch: a gain's error with the square of pressure",
     "Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells (1959), ch. 13"),
    ("sensor.velocity_gain", -0.15, 0.15, "",
     "a drag between the light barrier and the target: the same difference at all velocities",
     "Timmerman and van der Weele, Am. J. Phys. 67 (1999) 538, linear drag"),
    ("sensor.force_gain", -0.3, 0.3, "",
     "a crystal that reads long pulses higher, with the logarithm of their duration",
     "Damjanovic, Phys. Rev. B 55 (1997) R649, logarithmic frequency dependence of the "
     "piezoelectric effect"),
    ("sensor.force_bandwidth", 0.0, 25.0, "",
     "a converter that takes running means, three in a row",
     "Hogenauer, IEEE Trans. Acoust. Speech Signal Process. 29 (1981) 155"),
    ("sensor.acceleration_gain", -0.3, 0.4, "",
     "a sensitivity with one relaxation: another one below it than above",
     "Damjanovic et al., Appl. Phys. Lett. 78 (2001) 520, Maxwell-Wagner relaxation of ceramics"),
    ("sensor.mount_resonance", 0.0, 5.0, "",
     "a dry joint that softens with the level of the shock",
     "Ibrahim and Pettit, J. Sound Vib. 279 (2005) 857, bolted joints"),
    ("sensor.zero_shift", -0.05, 0.05, "",
     "an offset at the shock's peak that creeps back by a power of time",
     "Curie (1889) and von Schweidler (1907): Jonscher, Dielectric Relaxation in Solids (1983)"),
)  # fmt: skip

_SEALED: tuple[_LawRow, ...] = (
    ("gun.back_pressure", 0.9, 1.04, "",
     "the projectile drives a shock ahead of it: Rankine and Hugoniot's pressure on a piston",
     "Liepmann and Roshko, Elements of Gasdynamics (1957), section 3.8; "
     "Seigel, AGARDograph 91 (1965)"),
    ("gun.blow_by", 0.0, 60.0, "bullet",
     "laminar flow through a tight ring, with the cube of the bullet's clearance",
     "White, Viscous Fluid Flow (1974), section 3-3; eccentric: "
     "Piercy, Hooper and Winny, Phil. Mag. 15 (1933) 647"),
    ("gun.valve_flow", 0.0, 2.0, "",
     "an orifice whose discharge grows with the drop of pressure, behind a turning disc",
     "Perry, Trans. ASME 71 (1949) 757; disc: Idelchik, Handbook of Hydraulic Resistance, ch. 9"),
    ("gun.barrel_loss", 0.0, 8.0, "",
     "the gas behind follows by a simple wave: its pressure at the projectile falls with speed",
     "Seigel, The Theory of High Speed Guns, AGARDograph 91 (1965), ch. 2"),
    ("gun.sliding_friction", 0.0, 15.0, "bullet",
     "a press fit by bullet whose friction falls with speed, as its surface warms",
     "Bowden and Freitag, Proc. R. Soc. A 248 (1958) 350; Montgomery, Wear 38 (1976) 235"),
    ("gun.heat_exchange", 0.0, 300.0, "",
     "gas relaxes to its walls' temperature with a time constant, whatever its density",
     "Pourmovahed and Otis, J. Dyn. Syst. Meas. Control 112 (1990) 116"),
    ("gun.dead_volume", 0.0, 8.0, "",
     "a side cavity that fills through a hole of its own while the shot goes on",
     "Kinsler et al., Fundamentals of Acoustics, on Helmholtz's resonator; flow: "
     "Saint-Venant and Wantzel"),
    ("contact.viscous_loss", 0.0, 8.0, "tip",
     "a damper with the root of mass times stiffness and d^0.25, "
     "by the restitution of the tip's material",
     "Tsuji, Tanaka and Ishida, Powder Technol. 71 (1992) 239"),
    ("contact.plastic_yield", 0.0, 8.0, "tip",
     "finite elements' fit of a hardness that falls with the contact's size, "
     "with its residual indentation",
     "Jackson and Green, J. Tribol. 127 (2005) 343; "
     "Jackson, Green and Marghitu, Nonlinear Dyn. 60 (2010) 217"),
    ("contact.layer_compliance", 0.0, 4.0, "tip",
     "a spring and a damper side by side, in series with the contact, by tip",
     "Lakes, Viscoelastic Materials (2009), ch. 2, Kelvin and Voigt's solid"),
    ("contact.plate_compliance", 0.0, 2.0, "face",
     "a finite plate by its modes: waves come back from the edges",
     "Karas, Ing.-Arch. 10 (1939) 237; Goldsmith, Impact (1960), ch. 4"),
    ("contact.effective_mass", 0.0, 60.0, "",
     "a hand behind a spring and a damper: slow blows feel more of it",
     "ISO 10068:2012, impedance of the hand-arm system; "
     "Griffin, Handbook of Human Vibration (1990)"),
    ("contact.tip_geometry", 0.0, 12.0, "tip",
     "a ball that goes over into a cone, by tip material",
     "Popov, Hess and Willert, Handbook of Contact Mechanics (2019), section 2.5, "
     "paraboloid and cone"),
    ("plate.damping", -8.0, 30.0, "mode",
     "loss at the sensors' cables: each mode by its square there",
     "Ungar, J. Sound Vib. 26 (1973) 141, damping of attachments and joints"),
    ("plate.stiffness", -8.0, 8.0, "mode",
     "a rolled sheet: two families of modes that bend along it and across it",
     "Leissa, Vibration of Plates, NASA SP-160 (1969), on orthotropic plates"),
    ("plate.sensor_mass", 0.0, 0.3, "channel",
     "sensors of unlike mass with rotary inertia, which high modes feel more",
     "Blevins, Formulas for Natural Frequency and Mode Shape (1979); Rayleigh's quotient"),
    ("plate.boundary", 0.0, 200.0, "mode",
     "two of the supports hold, and they alone, in an eigenproblem of all modes",
     "Dowell, J. Appl. Mech. 46 (1979) 206, springs on arbitrary structures"),
    ("sensor.pressure_offset", -0.3, 0.3, "",
     "an error at the foot of the range that is gone above it",
     "Fraden, Handbook of Modern Sensors (2016), on dead bands and non-linearity"),
    ("sensor.pressure_gain", -0.3, 0.3, "",
     "two ranges with gains of their own, the error in the upper one",
     "JCGM 200:2012 (VIM), 4.7 measuring interval; Doebelin, Measurement Systems (2003), ch. 3.3"),
    ("sensor.velocity_gain", -0.15, 0.15, "bullet",
     "lengths of bullets (or bases of timing, by tip) that are wrong one by one",
     "thesis, eq. 5.2; JCGM 100:2008 (GUM), 5.1"),
    ("sensor.force_gain", -0.3, 0.3, "",
     "two ranges of the charge amplifier with gains of their own",
     "ISO 16063-21 and Kistler 5011 manual: range capacitors with a tolerance each"),
    ("sensor.force_bandwidth", 0.0, 25.0, "",
     "three equal poles in a row, of cable, amplifier and filter",
     "Doebelin, Measurement Systems (2003), ch. 3.3, cascaded first-order elements"),
    ("sensor.acceleration_gain", -0.3, 0.4, "channel",
     "a sensitivity that grows with the level, on one channel more than on the other",
     "ISO 16063-22:2005, amplitude linearity in shock calibration"),
    ("sensor.mount_resonance", 0.0, 5.0, "",
     "a block on a stud: two resonances in a row",
     "ISO 5348:2021, on mounting blocks"),
    ("sensor.zero_shift", -0.05, 0.05, "",
     "an offset at the shock's peak behind two high passes: it swings through zero",
     "Harris' Shock and Vibration Handbook, 6th ed. (2010), "
     "on zero shift behind AC-coupled amplifiers"),
)  # fmt: skip

#: Every law by effect and split.
LAWS: Mapping[tuple[str, str], SecondLaw] = {
    (row[0], split): SecondLaw(row[0], split, *row[1:])
    for split, rows in zip(SPLITS, (_DEVELOPMENT, _CALIBRATION, _SEALED), strict=True)
    for row in rows
}


def checked_split(split: str) -> str:
    """The split. Raises `ValueError` for one that has no laws."""
    if split not in SPLITS:
        raise ValueError(f"second laws for {split!r}: expected one of {', '.join(SPLITS)}")
    return split


def law_of(effect: str, split: str) -> SecondLaw:
    """Raises `ValueError` for an effect that has no such law."""
    if (effect, split) not in LAWS:
        raise ValueError(
            f"second law of {effect!r} for {split!r}: expected an effect of "
            f"the catalogue and {SPLITS}"
        )
    return LAWS[effect, split]
