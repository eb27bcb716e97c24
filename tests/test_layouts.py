"""KiCad boards and DXF drawings as workpieces."""

from __future__ import annotations

from fractions import Fraction

import pytest

from tcp import files
from tcp.errors import InputError
from tcp.files.route import route_csv

BOARD = """(kicad_pcb (version 20221018)
  (via (at 10 20) (size 0.8) (drill 0.4) (layers "F.Cu" "B.Cu"))
  (footprint "A (odd name)" (at 100 50 90)
    (pad "1" thru_hole circle (at 1 2 90) (size 2 2) (drill 0.4))
    (pad "2" smd rect (at 3 4) (size 1 1))
    (pad "3" np_thru_hole circle (at 0 0) (size 3 3) (drill 3.2)))
  (footprint "B" (at 0 0 45)
    (pad "1" thru_hole oval (at 1 0) (size 2 3) (drill oval 0.4 1.5))))
"""


def test_kicad_pads_and_vias(tmp_path):
    path = tmp_path / "b.kicad_pcb"
    path.write_text(BOARD)
    reading = files.read(path)
    piece = reading.workpiece
    places = [(float(h.x), float(h.y)) for h in map(piece.hole, range(len(piece)))]
    assert places == [(10.0, -20.0), (102.0, -49.0), (0.707107, 0.707107)]
    assert piece.hole(0).diameter == Fraction(2, 5)
    assert "1 oval" in reading.notes[0] and "non-plated" in reading.notes[1]
    assert len(files.read(path, tool="all").workpiece) == 4
    assert float(files.read(path, tool="T1").workpiece.hole(0).x) == 100.0
    with pytest.raises(InputError, match="its tools are"):
        files.read(path, tool="T9")


PAD = '(kicad_pcb (footprint "x" (at 1 1)\n (pad "1" thru_hole circle {})))'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("(kicad_pcb", "cut off"),
        ("(kicad_pcb))", r":1: closes more"),
        ("(kicad_sch)", "no KiCad board"),
        ("(kicad_pcb)", "no drilled hole"),
        ("(kicad_pcb\n (via (at 1) (drill 1)))", r":2: a via .* no place; expected \(at X Y\)"),
        ("(kicad_pcb (via (at 1 x) (drill 1)))", "a via is not understood: 'x'"),
        ("(kicad_pcb (via (at) (drill 1)))", "the via has no place"),
        ("(kicad_pcb (via (at (1) 2) (drill 1)))", "the via has no place"),
        ("(kicad_pcb (via (size 1) (drill 0.3)))", "the via has no place"),
        ("(kicad_pcb (via (at 1 2) (drill)))", r"no size; expected \(drill D\)"),
        ("(kicad_pcb (via (at 1 2) (drill (1))))", r"no size; expected \(drill D\)"),
        (PAD.format("(drill 0.3)"), ":2: a pad .* the pad has no place"),
        (PAD.format("(at 1 2) (drill oval)"), ":2: a pad .* no size; .* oval W H"),
        (PAD.replace("(at 1 1)", "").format("(at 1 2) (drill 1)"), "the footprint has no place"),
        (PAD.format("(at 1 2) (drill (offset 1 0))"), "no drilled hole"),
        ("(kicad_pcb (via (at 0 2444444444444) (drill 0.4)))", "beyond any workpiece"),
        ("(" * 1000, "no S-expression"),
        ("", "the file is empty"),
        ("(kicad_pcb) (kicad_pcb)", "expected one list"),
        ("(kicad_pcb (via (at 1 2) (drill -1)))", "a drill of '-1' mm"),
        ("(kicad_pcb (via (at 1 2) (drill 0)))", "has no drill"),
        ('(kicad_pcb (footprint "" (pad "" thru_hole circle (at 1 2) (drill 0))))', "no drilled"),
    ],
)
def test_bad_kicad_boards(tmp_path, text, said):
    path = tmp_path / "b.kicad_pcb"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        files.read(path)


def test_vias_that_do_not_go_through_are_tools_of_their_own(tmp_path):
    kinds = {"blind": '"F.Cu" "In1.Cu"', "micro": '"F.Cu" "In1.Cu"', "": '"F.Cu" "B.Cu"'}
    vias = [
        f"(via {kind} (at {i} 0) (drill 0.3) (layers {layers}))"
        for i, (kind, layers) in enumerate(kinds.items())
    ]
    path = tmp_path / "b.kicad_pcb"
    path.write_text(f"\ufeff(kicad_pcb {' '.join(vias)})", encoding="utf-8")
    reading = files.read(path)
    assert [float(reading.workpiece.hole(i).x) for i in range(len(reading.workpiece))] == [0, 1]
    assert "T1 (2) 0.3 mm F.Cu to In1.Cu, T2 (1) 0.3 mm plated" in reading.notes[-1]


def test_dxf_circles_and_points(tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed (tcp-drill[dxf])")
    drawing = ezdxf.new(units=4)
    space = drawing.modelspace()
    space.add_circle((1, 2), 0.5, dxfattribs={"layer": "drill"})
    space.add_circle((3, 4), 0.5, dxfattribs={"layer": "drill"})
    space.add_point((9, 9), dxfattribs={"layer": "marks"})
    path = tmp_path / "b.dxf"
    drawing.saveas(path)
    reading = files.read(path)
    assert [float(reading.workpiece.hole(i).x) for i in range(2)] == [1.0, 3.0]
    assert reading.workpiece.hole(0).diameter == 1
    everything = files.read(path, tool="all")
    assert len(everything.workpiece) == 3 and "all are taken" in everything.notes[-1]
    cut = tmp_path / "cut.dxf"
    cut.write_text(path.read_text()[:3000])
    with pytest.raises(InputError, match=r"no DXF drawing: .+"):
        files.read(cut)
    with pytest.raises(InputError, match="other units"):
        files.read(path, units="inch")
    path.write_text("nonsense")
    with pytest.raises(InputError, match="no DXF"):
        files.read(path)


@pytest.mark.parametrize(
    ("code", "mm"),
    [(1, 25.4), (2, 304.8), (4, 1), (8, 25.4e-6), (9, 0.0254), (10, 914.4), (13, 0.001), (14, 100)],
)
def test_dxf_units(tmp_path, code, mm):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed (tcp-drill[dxf])")
    path = tmp_path / "b.dxf"
    drawing = ezdxf.new(units=code)
    drawing.modelspace().add_circle((0.5, 0), 0.25)
    drawing.saveas(path)
    hole = files.read(path).workpiece.hole(0)
    assert float(hole.x) == pytest.approx(mm / 2, abs=1e-6)
    if code not in (1, 4):
        for units in ("mm", "inch"):
            with pytest.raises(InputError, match="states other units"):
                files.read(path, units=units)


def test_dxf_units_that_no_workpiece_has(tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed (tcp-drill[dxf])")
    path = tmp_path / "b.dxf"
    drawing = ezdxf.new(units=18)
    drawing.modelspace().add_circle((1, 2), 0.25)
    drawing.saveas(path)
    for units in (None, "mm"):
        with pytest.raises(InputError, match=r"\$INSUNITS 18"):
            files.read(path, units=units)


BARE = "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\n0\n10\n1.0\n20\n2.0\n40\n0.5\n0\nENDSEC\n0\nEOF\n"


def test_a_drawing_without_a_header_states_no_units(tmp_path):
    pytest.importorskip("ezdxf", reason="ezdxf is not installed (tcp-drill[dxf])")
    path = tmp_path / "b.dxf"
    for text in (BARE, f"999\n$INSUNITS\n{BARE}"):
        path.write_text(text)
        with pytest.raises(InputError, match="does not state its units"):
            files.read(path)
        for units, x in (("mm", 1), ("inch", Fraction(254, 10))):
            assert files.read(path, units=units).workpiece.hole(0).x == x


@pytest.mark.parametrize("radius", ["-0.4", "0"])
def test_a_circle_without_a_radius_is_refused(tmp_path, radius):
    pytest.importorskip("ezdxf", reason="ezdxf is not installed (tcp-drill[dxf])")
    path = tmp_path / "b.dxf"
    path.write_text(BARE.replace("40\n0.5", f"40\n{radius}"))
    with pytest.raises(InputError, match=f"circle at 1 2 has a radius of {radius}; .* more than 0"):
        files.read(path, units="mm")


def test_points_have_no_diameter_and_read_back(tmp_path):
    pytest.importorskip("ezdxf", reason="ezdxf is not installed (tcp-drill[dxf])")
    path = tmp_path / "b.dxf"
    path.write_text(BARE.replace("CIRCLE", "POINT"))
    piece = files.read(path, units="mm").workpiece
    assert piece.diameters == (None,)
    again = tmp_path / "route.csv"
    again.write_text(route_csv(piece, (0,)))
    assert files.read(again).workpiece.hole(0).x == 1


@pytest.mark.parametrize("version", ["R12", "R2000", "R2018"])
def test_binary_drawings_state_their_units_too(tmp_path, version):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed (tcp-drill[dxf])")
    path = tmp_path / "b.dxf"
    drawing = ezdxf.new(version, units=5)
    drawing.modelspace().add_circle((1, 2), 0.25)
    drawing.saveas(path, fmt="bin")
    if version == "R12":  # which has no such variable
        with pytest.raises(InputError, match="does not state its units"):
            files.read(path)
    else:
        assert files.read(path).workpiece.hole(0).x == 10


@pytest.mark.parametrize("number", ["nan", "inf", "1e300"])
def test_a_circle_that_lies_nowhere_is_refused(tmp_path, number):
    pytest.importorskip("ezdxf", reason="ezdxf is not installed (tcp-drill[dxf])")
    path = tmp_path / "d.dxf"
    path.write_text(
        "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n"
        f"2\nENTITIES\n0\nCIRCLE\n8\nvia\n10\n{number}\n20\n2.5\n40\n0.4\n0\nENDSEC\n0\nEOF\n"
    )
    with pytest.raises(InputError, match=r"no finite place|beyond any workpiece"):
        files.read(path)


VIAS = """(kicad_pcb (version 4)
  (net 0 "") (net 1 GND)
  (net_class Default "" (via_dia 0.6) (via_drill 0.4) (add_net GND) (add_net ""))
  (via (at 1 2) (size 0.8) (net 1))
  (via (at 3 4) (size 0.8) (drill 0.3) (net 1)))
"""


def test_vias_without_a_drill_take_that_of_their_net_class(tmp_path):
    path = tmp_path / "b.kicad_pcb"
    path.write_text(VIAS)
    piece = files.read(path, tool="all").workpiece
    assert {piece.hole(k).diameter for k in range(2)} == {Fraction(3, 10), Fraction(2, 5)}
    path.write_text(VIAS.replace("(via_drill 0.4)", ""))
    with pytest.raises(InputError, match="the via at 1 2 has no drill"):
        files.read(path)


def test_circles_seen_from_below_and_in_blocks(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new()
    drawing.header["$INSUNITS"] = 4
    space = drawing.modelspace()
    space.add_circle((20, 5), 1, dxfattribs={"extrusion": (0, 0, -1)})
    space.add_circle((7, 5), 1)
    drawing.blocks.new("inner").add_point((0, 0))
    drawing.blocks.new("outer").add_blockref("inner", (1, 1))
    space.add_blockref("outer", (50, 50))
    path = tmp_path / "d.dxf"
    drawing.saveas(path)
    reading = files.read(path)
    places = {(float(h.x), float(h.y)) for h in map(reading.workpiece.hole, range(2))}
    assert places == {(-20.0, 5.0), (7.0, 5.0)}
    assert any("1 block reference with circles" in note for note in reading.notes)
    space.add_circle((0, 0), 1, dxfattribs={"extrusion": (0, 1, 0)})
    drawing.saveas(path)
    with pytest.raises(InputError, match="plane"):
        files.read(path)


def test_arcs_and_ellipses_that_are_circles_are_noted(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new(units=4)
    space = drawing.modelspace()
    space.add_circle((1, 2), 1)
    path = tmp_path / "d.dxf"
    for turn in ((0, 90), (10, 350)):
        space.add_arc((0, 0), 1, *turn)
    space.add_ellipse((0, 0), (1, 0), 0.5)
    space.add_ellipse((0, 0), (1, 0), 1, 0, 3.14)
    drawing.saveas(path)
    assert not any("left out" in note for note in files.read(path).notes)
    for turn in ((0, 360), (90, 450), (180, -180)):
        space.add_arc((0, 0), 1, *turn)
    space.add_ellipse((0, 0), (1, 0), 1, 0, 6.283185)
    drawing.blocks.new("round").add_arc((0, 0), 1, 0, 360)
    space.add_blockref("round", (5, 5))
    drawing.saveas(path)
    reading = files.read(path)
    assert len(reading.workpiece) == 1
    assert "4 full circles drawn as arc or ellipse left out; draw circles" in reading.notes
    assert any("1 block reference with circles" in note for note in reading.notes)
