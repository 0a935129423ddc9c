"""Trajectories on the map, read back by other means: the right place and height to a millimetre, and valid text."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pymap3d
import pytest

from ftproc.core.model.frames import to_cartesian
from ftproc.errors import InputError, UsageError
from ftproc.files import layout
from ftproc.files.writing import geodesy, maps, trajectories
from ftproc.records import Trajectory
from ftproc.settings import FilterSettings

SITE = (48.0812, 11.2803, 612.0)
KML = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}
AER = np.column_stack([np.linspace(10, 350, 7), np.linspace(1, 80, 7), np.linspace(5e3, 200e3, 7)])


def flight(rows=slice(None), *, missing=(), site=SITE, geoid=None, epoch="", name="in/a<b>&\"c'.csv"):
    """A trajectory of seven places, known by azimuth deg clockwise from north, elevation deg and range m."""
    aer = AER[rows]
    state = np.full((len(aer), 9), 1.0)
    state[:, :3] = to_cartesian(np.column_stack([aer[:, 2], np.deg2rad(aer[:, :2])]))
    state[list(missing)] = np.nan
    blank, n = np.zeros((len(aer), 6)), len(aer)
    settings = {"site": site, "smooth": True, "geoid_m": geoid}
    metadata = {"frame": "north-east-up", "settings": settings, "method": "ukf", "version": "1", "epoch": epoch}
    plain = Trajectory(
        name, np.arange(n), 100.0 + np.arange(n), blank[:, :3], state, np.zeros((n, 9)), blank[:, :3],
        np.zeros((n, 3), np.uint8), blank[:, 0], blank, metadata,
    )  # fmt: skip
    return geodesy.located(plain, FilterSettings(site=site))


def expected(site=SITE):
    latitude, longitude, height = pymap3d.aer2geodetic(*AER.T, *site)
    return np.column_stack([longitude, latitude, height])


def same_place(found, wanted):
    on_ground = np.array([111_320.0, 111_320.0, 1.0])
    np.testing.assert_array_less(np.abs((np.array(found, float) - wanted) * on_ground), 1e-3)


def kml(trajectory):
    return ElementTree.fromstring(maps.as_bytes(trajectory, ".kml"))


def lines(document):
    found = document.findall(".//k:LineString/k:coordinates", KML)
    return [[list(map(float, place.split(","))) for place in line.text.split()] for line in found]


def test_kml_is_at_the_right_place_and_says_what_its_heights_are():
    document = kml(flight())
    same_place(lines(document)[0], expected())
    modes = {mode.text for mode in document.findall(".//k:altitudeMode", KML)}
    assert modes == {"absolute"}
    assert "Heights are above the WGS-84 ellipsoid." in document.find(".//k:description", KML).text
    assert document.findall(".//gx:Track", KML) == []
    station = document.find(".//k:Point/k:coordinates", KML).text
    same_place([float(part) for part in station.split(",")], (SITE[1], SITE[0], SITE[2]))


def test_kml_counts_from_the_geoid_where_it_is_known():
    document = kml(flight(geoid=46.2))
    same_place(lines(document)[0], expected() - (0, 0, 46.2))
    assert "above the geoid, which is 46.2 m above the ellipsoid here" in document.find(".//k:description", KML).text
    assert document.find(".//k:Point/k:coordinates", KML).text.endswith(",565.8")


def test_kml_in_time_where_the_day_is_known():
    track = kml(flight(epoch="2024-05-31T00:00:00Z")).find(".//gx:Track", KML)
    whens = [when.text for when in track.findall("k:when", KML)]
    assert whens[:2] == ["2024-05-31T00:01:40.000000Z", "2024-05-31T00:01:41.000000Z"]
    same_place([coord.text.split() for coord in track.findall("gx:coord", KML)], expected())


def test_geojson():
    found = json.loads(maps.as_bytes(flight(), ".geojson"))
    station, line = found["features"]
    assert station["geometry"] == {"type": "Point", "coordinates": [11.2803, 48.0812, 612.0]}
    assert line["geometry"]["type"] == "MultiLineString"
    same_place(line["geometry"]["coordinates"][0], expected())
    assert line["properties"]["time_s"] == [[100.0, 101.0, 102.0, 103.0, 104.0, 105.0, 106.0]]


@pytest.mark.parametrize(("epoch", "first"), [("", 0.0), ("2024-05-31T00:00:00Z", 100.0)])
def test_czml(epoch, first):
    document, station, target = json.loads(maps.as_bytes(flight(epoch=epoch), ".czml"))
    samples = np.array(target["position"]["cartographicDegrees"]).reshape(-1, 4)
    np.testing.assert_array_equal(samples[:, 0], first + np.arange(7.0))
    same_place(samples[:, 1:], expected())
    assert target["position"]["epoch"] == (epoch or "2000-01-01T00:00:00Z")
    assert ("its first sample is placed at 2000-01-01" in target["description"]) == (not epoch)
    start = "2024-05-31T00:01:40" if epoch else "2000-01-01T00:00:00"
    assert document["clock"]["interval"].startswith(start)
    assert station["position"]["cartographicDegrees"] == [11.2803, 48.0812, 612.0]


def test_names_cannot_break_the_text():
    odd = "a<b>&\"c'.csv"
    assert kml(flight()).find(".//k:MultiGeometry/../k:name", KML).text == odd
    assert kml(flight(name="bell\x07.csv")).find("k:Document/k:name", KML).text == "bell?.csv"
    assert json.loads(maps.as_bytes(flight(), ".geojson"))["features"][1]["properties"]["name"] == "a‹b›+”c’.csv"


@pytest.mark.parametrize("name", ["<img src=x onerror=alert(1)>.csv", "a</script>.csv", "&lt;img&gt;.csv", "\"'`.csv"])
@pytest.mark.parametrize("kind", [".geojson", ".czml"])
def test_a_name_is_no_element_of_a_page(name, kind):
    """A viewer may put it there as it is."""
    for epoch in ("", "2024-05-31T00:00:00Z"):
        text = maps.as_bytes(flight(name=name, epoch=epoch), kind).decode()
        assert not set("<>&'") & set(text)
        found = json.loads(text)
        named = found["features"][1]["properties"]["name"] if kind == ".geojson" else found[2]["name"]
        assert named.endswith(".csv")
        assert not set("<>&\"'") & set(named)


def test_gaps_part_the_line_and_lone_places_make_none():
    found = flight(missing=(2, 4))
    wanted = expected()
    assert [len(line) for line in lines(kml(found))] == [2, 2]
    same_place(lines(kml(found))[1], wanted[5:])
    line = json.loads(maps.as_bytes(found, ".geojson"))["features"][1]
    assert line["properties"]["time_s"] == [[100.0, 101.0], [105.0, 106.0]]
    samples = np.array(json.loads(maps.as_bytes(found, ".czml"))[2]["position"]["cartographicDegrees"])
    assert len(samples) == 4 * 5


def test_the_antimeridian_parts_the_line():
    found = lines(kml(flight(site=(0.0, 180.0, 0.0))))
    assert len(found) > 1
    for line in found:
        assert np.ptp(np.array(line)[:, 0]) < 180


def test_same_trajectory_same_bytes():
    for kind in layout.MAPS:
        assert maps.as_bytes(flight(), kind) == maps.as_bytes(flight(), kind)


def test_through_a_file_with_its_metadata_beside(tmp_path):
    trajectories.write(flight(), tmp_path / "a.KML")
    assert (tmp_path / "a.KML").read_bytes() == maps.as_bytes(flight(), ".kml")
    assert json.loads((tmp_path / "a.json").read_bytes())["method"] == "ukf"


def test_nothing_to_draw(tmp_path):
    with pytest.raises(InputError, match=r"no position could be estimated, so there is nothing to draw on a map\."):
        trajectories.write(flight(missing=range(7)), tmp_path / "a.kml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", layout.MAPS)
def test_without_a_station(kind):
    sentence = f"a \\{kind} map needs the station: give --site LAT,LON,HEIGHT, or \\[site\\] in the --config file."
    with pytest.raises(UsageError, match=f"x\\{kind}: {sentence}"):
        maps.check(f"x{kind}", None)
    with pytest.raises(UsageError, match=sentence):
        maps.as_bytes(replace(flight(), extra=None), kind)
    maps.check("x.csv", None)


@pytest.mark.parametrize(("kind", "library"), [(".kml", "simplekml>=1.3.6"), (".czml", "czml3>=4")])
def test_without_the_library(monkeypatch, kind, library):
    name = library.partition(">")[0]
    monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, f"{name}.properties", raising=False)
    with pytest.raises(UsageError) as caught:
        maps.check(f"x{kind}", SITE)
    assert str(caught.value) == f'{kind} files need {name}, which is not installed: pip install "{library}".'
