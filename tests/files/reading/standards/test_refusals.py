"""What holds no log is refused by what it is, and what is damaged in one sentence."""

import contextlib

import numpy as np
import pytest

from ftproc.errors import InputError
from ftproc.files.limits import Room
from ftproc.files.reading import logs
from ftproc.files.reading.formats.standards import asterix, octets
from tests.files.conftest import Make, refused
from tests.files.zoo import radars, standards
from tests.files.zoo.flight import flight

SURVEY = "points of a survey without times"
TLE = (
    "1 25544U 98067A   24152.50000000  .00016717  00000+0  10270-3 0  9001\n"
    "2 25544  51.6400 208.9163 0006317  69.9862  25.2906 15.49560000 10001\n"
)
NOT_A_LOG = {
    "CPF": ("H1 CPF 2 CNE 2018 6 13 6 164 1 target\nH9\n10 0 58282 0.0 0 6566174.6 2703003.2 -3022783.9\n", "(CPF)"),
    "SP3": (
        "#dP2024  5 31  0  0  0.00000000      96 ORBIT IGS20 HLM  IGS\n* 2024 5 31\nPG01 1.0 2.0 3.0\n",
        "an SP3 file",
    ),
    "OEM": ("CCSDS_OEM_VERS = 2.0\nMETA_START\nMETA_STOP\n2024-05-31T00:00:00 1 2 3 4 5 6\n", "an ephemeris"),
    "two-line elements": (f"STATION\n{TLE}", "orbits in two-line elements"),
    "IOD": ("23794 96 010A   2701 G 20040506012614270 17 25 1100114-184298 38 I+020 10\n" * 3, "right ascension"),
    "CMN": ("Station_Code: APO\n" + "2457818.4514367362 082.017 +33.950 +1.2\n" * 3, "right ascension"),
    "RINEX": (f"{'     3.04           OBSERVATION DATA    M':60s}RINEX VERSION / TYPE\n> 2024 1\n", "a GNSS receiver"),
    "GPX": (
        '<?xml version="1.0"?>\n<gpx version="1.1"><trkpt lat="48.1" lon="11.3"/></gpx>\n',
        "positions on the earth",
    ),
    "IGC": ("AXXX001\nHFDTE310524\nB1234564807123N01131123EA0060000700\n", "(IGC)"),
    "LandXML": ('<LandXML version="1.2"><RawObservation horizAngle="281.9" slopeDistance="72.8"/></LandXML>\n', SURVEY),
    "RW5": ("JB,NMX,DT07-22-2004\nLS,HI5.6,HR5.5\nSS,OP111,FP108,AR0.00,ZE0.17,SD3.35,--FENCE\n", SURVEY),
    "Nikon": ("CO,Nikon RAW data format V2.00\nSS,2,1.500,8.986,107.9916,102.3376,14:00:04,P\n", SURVEY),
    "SDR": ("00NMSDR33 V04-04.02     01-Jan-02 00:00 113111\n09F10001000210.123\n", SURVEY),
    "Horizons": ("Ephemeris\n$$SOE\n 2024-May-31 00:00 120.1 35.2 1.01\n$$EOE\n", "an ephemeris"),
    "SBS-1": (
        "MSG,3,1,1,3C660C,1,2024/05/31,12:00:00.0,,,,37000,,,48.1,11.3,,,,,,0\n" * 3,
        "(SBS-1)",
    ),
    "JobXML": (
        '<?xml version="1.0"?>\n<JOBFile jobName="a"><FieldBook/></JOBFile>\n',
        "points of a survey; to filter the track of a prism in it, export times",
    ),
    "Topcon": ("_'P1_(CODE_)1.500_ ?+00008986m1079916+1023376d+00008978t60+00+25\n", SURVEY),
    "GSI": ("110001+00000001 21.322+03496940 22.322+09364360 31..00+00030485 51..1.+0000+000\n" * 30, SURVEY),
    "TLL": (standards.checked("RATLL,01,4807.0,N,01131.0,E,TGT,123456.0,T,") + "\n", "positions of targets (TLL)"),
    "AIS": ("!AIVDM,1,1,,A,13HOI:0P0000VOHLCnHQKwvL05Ip,0*23\n" * 3, "positions that ships broadcast"),
    "RADEC": (
        "CCSDS_TDM_VERS = 1.0\nMETA_START\nTIME_SYSTEM = UTC\nPARTICIPANT_1 = A\nANGLE_TYPE = RADEC\nMETA_STOP\n"
        "DATA_START\nANGLE_1 = 2024-05-31T00:00:00 12.5\nDATA_STOP\n",
        "no range, azimuth or elevation of a target, but right ascension and declination",
    ),
}


@pytest.mark.parametrize("name", NOT_A_LOG)
def test_what_is_no_log_is_called_by_its_name(make: Make, name: str) -> None:
    content, sentence = NOT_A_LOG[name]
    said = refused(make(content, "a.txt"))
    assert sentence in said
    assert "--columns" not in said


def test_a_log_under_two_line_elements_is_a_log(make: Make) -> None:
    rows = "".join(f"{k},{900 - k},{10 + k / 10},{20 + k / 10}\n" for k in range(40))
    log = logs.read(
        make(f"Pass of the station\nElements of the day\n{TLE}time_s,range_km,az_deg,el_deg\n{rows}", "a.txt")
    )
    assert len(log) == 40


def test_positions_and_single_plots_are_no_track(make: Make) -> None:
    adsb = radars.block(21, bytes(9)) * 3 + radars.sector(9.0)
    said = refused(make(adsb, "a.ast"))
    assert "category 021 (positions that aircraft broadcast (ADS-B)), 034 (status of a sensor or service)" in said
    rows = list(radars.readings())[:3]
    one_each = b"".join(radars.block(48, radars.plot_048(*row, icao=k + 1)) for k, row in enumerate(rows))
    assert "3 plots of as many targets, of which none is seen twice" in refused(make(one_each, "a.ast"))


@pytest.mark.parametrize("which", range(4))
def test_damage_is_said_in_a_sentence(make: Make, which: int) -> None:
    content, name = (
        ("h1 CRD 2 2024 5 31 12\nh4 0 2024 5 31 12 0 0\n10 inf 0.04 std 2 0\n", "a.frd"),
        ("CCSDS_TDM_VERS = 2.0\nTIME_SYSTEM = TAI\nDATA_START\nRANGE = 2024-99-01T00:00:00 7\n", "a.tdm"),
        ("$GPZDA,123456.0,31,99,2024,00,00\n$RATTM,01,3.1,4.5,T,1,2,T,3,4,N,A,T,,,A\n" * 9, "a.log"),
        ("2024-05-31T99:00:00 RANGE Fucino 38014.9\n" * 9, "a.aer"),
    )[which]  # fmt: skip
    assert "internal" not in refused(make(content, name))


def test_cut_blocks_end_without_a_crash(make: Make) -> None:
    whole = b"".join(radars.block(48, radars.plot_048(*row)) for row in radars.readings())
    packets = radars.captured([radars.block(48, radars.plot_048(*row)) for row in radars.readings()])
    rng = np.random.default_rng(1)
    for data in (whole, packets):
        for cut in rng.integers(1, len(data), 40):
            spoilt = bytearray(data[:cut])
            spoilt[rng.integers(0, cut)] = rng.integers(0, 256)
            with contextlib.suppress(InputError):
                asterix.binary(bytes(spoilt), Room("a", len(data)))
    assert list(octets.records(whole[:-1])) == []


def test_plots_of_other_categories_are_counted(make: Make) -> None:
    one = b"".join(radars.block(48, radars.plot_048(*row)) + radars.sector(1.0) for row in radars.readings())
    log = logs.read(make(one, "a.ast"))
    assert len(log) == len(flight().t)
    assert log.frame == "north-east-up"
    assert "120 records of ASTERIX are left out, which are no plots of category 048" in log.remarks


def test_commanded_angles_of_a_laser_are_no_readings(make: Make) -> None:
    text = next(iter(standards.laser())).write(make("", "x").parent)
    log = logs.read(text)
    assert np.isnan(log.measurement[:, 1:]).all()
    assert "1 pointing angles commanded, not measured, left out" in log.remarks
