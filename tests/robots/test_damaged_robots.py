"""Damaged robot files: each ends as one sentence that names file and body, and none as another robot."""

from __future__ import annotations

import os

import pytest
from loading_guard import SECONDS
from robot_texts import DATA, MJCF, URDF
from time_limit import within

import jffsr
from jffsr.errors import InputError

YAML = (DATA / "robots" / "two_arms.yaml").read_text(encoding="utf-8")
TEXTS = {"urdf": URDF, "xml": MJCF, "yaml": YAML}

J2 = '<parent link="shoulder"/><child link="boom"/>'
LEFT = '<joint name="left_shoulder" pos="0.1 0.02 -0.03"/>'
LOWER_INERTIAL = '<inertial pos="0 0.2 0" quat="0.9 0.1 0.3 -0.2" mass="2.5" diaginertia="0.05 0.04 0.03"/>'

# What stands in the good file, what stands there in the damaged one, and what the message says, in order.
DAMAGED = [
    # URDF: numbers
    ("urdf", '<mass value="6"/>', '<mass value="0"/>', ["link 'boom'", "mass is 0 kg; it must be positive"]),
    ("urdf", '<mass value="4"/>', '<mass value="-4"/>', ["link 'shoulder'", "mass is -4 kg; it must be positive"]),
    ("urdf", '<mass value="4"/>', '<mass value="nan"/>', [":14: link 'shoulder'", "value 'nan' is not finite"]),
    ("urdf", '<mass value="4"/>', '<mass value="four"/>', [":14: link 'shoulder'", "value is 'four'; a number"]),
    ("urdf", '<mass value="4"/>', '<mass/>', [":14: link 'shoulder'", "<mass> has no 'value'"]),
    ("urdf", '<mass value="4"/>', "", [":14: link 'shoulder'", "<inertial> has no <mass>"]),
    ("urdf", 'izz="7"', 'izz="70"', ["link 'bus'", "break the triangle inequality"]),
    ("urdf", 'ixy="0.2"', 'ixy="20"', ["link 'bus'", "all must be positive"]),
    ("urdf", 'ixy="0.2" ', "", ["link 'bus'", "<inertia> has no 'ixy'"]),
    ("urdf", 'xyz="0 0.1 0.2"', 'xyz="0 inf 0.2"', ["joint 'j2'", "xyz '0 inf 0.2' is not finite"]),
    ("urdf", 'xyz="0 0.1 0.2"', 'xyz="0 0,1 0.2"', ["joint 'j2'", "three numbers expected"]),
    ("urdf", 'xyz="0 0.1 0.2"', 'xyz="0 1e7 0.2"', ["joint 'j2'", "position [0.0, 10000000.0, 0.2] m is farther"]),
    ("urdf", 'rpy="1.2 0 -0.4"', 'rpy="1.2 0"', ["joint 'j2'", "rpy is '1.2 0'; three numbers expected"]),
    ("urdf", '<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', ["joint 'j2'", "axis [0.0, 0.0, 0.0] has length zero"]),
    ("urdf", 'lower="-1.5" upper="2"', 'lower="2" upper="-1.5"', ["joint 'j2'", "position limits [2, -1.5]"]),
    ("urdf", 'effort="40"', 'effort="-40"', ["joint 'j2'", "torque limit is -40; it must be positive"]),
    # URDF: words and structure
    ("urdf", "<inertial><origin xyz=\"0.4", "<inertail><origin xyz=\"0.4", ["mismatched tag"]),
    ("urdf", 'rpy="0 0.5 0"', 'rpi="0 0.5 0"', ["joint 'j1'", "attribute 'rpi'; did you mean 'rpy'?"]),
    ("urdf", J2, J2.replace("boom", "bom"), ["joint 'j2'", "child link 'bom' does not exist"]),
    ("urdf", J2, J2.replace("shoulder", "sholder"), ["joint 'j2'", "parent link 'sholder' does not exist"]),
    ("urdf", J2, J2.replace("boom", "bus"), ["link 'bus' has two parents (joints 'mount' and 'j2'); closed loops"]),
    ("urdf", 'name="j2" type="revolute"', 'name="j2" type="hinge"', ["joint 'j2'", "type 'hinge' is not supported"]),
    ("urdf", 'name="j2" type="revolute"', 'name="j2" type="planar"', ["joint 'j2'", "type 'planar' is not supported"]),
    ("urdf", 'name="j2" type="revolute"', 'name="j2" type="floating"', ["joint 'j2'", "'floating' is not supported"]),
    ("urdf", '<axis xyz="0 1 0"/>', '<mimic joint="j1"/>', ["joint 'j2'", "<mimic> couples it to another joint"]),
    ("urdf", '<link name="boom">', '<link name="lidar">', ["two links are named 'lidar'"]),
    ("urdf", 'name="j2"', 'name="j1"', ["two joints are named 'j1'"]),
    ("urdf", '<link name="wrist">', '<link name="stub"/><link name="wrist">', ["'world' and 'stub'"]),
    ("urdf", '<parent link="world"/>', '<parent link="gripper"/>', ["'world' has no mass", "jffsr.attach"]),
    ("urdf", "<gazebo", '<loop_joint name="ring"/><gazebo', ["loop joint 'ring': closed loops are not supported"]),
    ("urdf", 'name="mount" type="fixed"', 'name="mount" type="continuous"', ["'world' has no mass", "'mount' moves"]),
    ("urdf", '<link name="shoulder">', '<xacro:arm/><link name="shoulder">', ["this is a xacro file"]),
    # MJCF: numbers
    ("xml", 'mass="60"', 'mass="-60"', [":24: body 'bus'", "mass is -60 kg; it must be positive"]),
    ("xml", 'mass="60"', 'mass="0"', ["body 'bus'", "it moves and has no inertia"]),
    ("xml", 'mass="60"', 'mass="inf"', ["body 'bus'", "mass 'inf' is not finite"]),
    ("xml", 'fullinertia="6 7 8', 'fullinertia="6 7 80', [":22: body 'bus'", "A + B >= C"]),
    ("xml", 'autolimits="true"', 'inertiafromgeom="false"', ["body 'left_upper'", "it moves and has no inertia"]),
    ("xml", LOWER_INERTIAL, LOWER_INERTIAL.replace("0.2 0", "inf 0"),
     ["body 'left_lower'", "'0 inf 0' is not finite"]),
    ("xml", 'pos="0.1 0.02 -0.03"', 'pos="0.1 0.02"', ["body 'left_upper': joint 'left_shoulder'", "enough data"]),
    ("xml", 'axis="0 -1 0"', 'axis="0 0 0"', ["body 'right_upper': joint 'right_slide'", "axis too small"]),
    ("xml", 'range="0 0.4"', 'range="0.4 0"', ["body 'right_upper': joint 'right_slide'", "limits [0.4, 0]"]),
    ("xml", '<geom type="ellipsoid" size="0.1 0.2 0.15"/>', "", ["body 'right_lower': it moves and has no inertia"]),
    # MJCF: what a free-floating tree of rigid bodies has not
    ("xml", "<sensor>", '<equality><weld name="grip" body1="left_lower" body2="right_lower"/></equality><sensor>',
     ["equality constraint <weld> 'grip': closed loops"]),
    ("xml", "<sensor>", '<equality><joint joint1="left_elbow" joint2="left_shoulder"/></equality><sensor>',
     ["equality constraint <joint>", "coupled joints are not supported"]),
    ("xml", "<sensor>", '<tendon><fixed name="rope"><joint joint="left_elbow" coef="1"/></fixed></tendon><sensor>',
     ["tendon <fixed> 'rope': tendons are not supported"]),
    ("xml", "<sensor>", '<deformable><flex name="cloth"/></deformable><sensor>', ["deformable <flex> 'cloth'"]),
    ("xml", "<sensor>", '<extension><plugin plugin="mujoco.pid"/></extension><sensor>', ["plugins are not supported"]),
    ("xml", LEFT, '<joint name="left_shoulder" type="ball"/>',
     ["body 'left_upper'", "'left_shoulder' is a ball joint"]),
    ("xml", LEFT, LEFT + '<joint name="roll" axis="1 0 0"/>',
     ["body 'left_upper'", "2 joints ('left_shoulder' and 'roll'); one joint a body"]),
    ("xml", LEFT, LEFT.replace("/>", ' stiffness="3"/>'), ["joint 'left_shoulder' has a spring (stiffness 3)"]),
    ("xml", LEFT, "<freejoint/>", ["body 'left_upper'", "free joint"]),
    ("xml", "<freejoint/>", '<joint name="pan" axis="0 0 1"/>', ["body 'bus': joint 'pan' hinges it on the world"]),
    ("xml", '<frame pos="0 0 1"', '<body name="rock"><geom size="1"/></body><frame pos="0 0 1"',
     ["bodies 'rock' and 'bus' both stand in <worldbody>"]),
    ("xml", '<body name="left_tool_plate"', '<body mocap="true" name="left_tool_plate"',
     ["body 'left_tool_plate'", "mocap"]),
    ("xml", LEFT, LEFT + '<composite type="cable" count="5 1 1" size="1"/>', ["body 'left_upper'", "<composite>"]),
    ("xml", LEFT, LEFT + '<replicate count="999999999"><geom size="1"/></replicate>', ["more than 1000 copies"]),
    ("xml", LEFT, LEFT + '<attach model="a" prefix="b"/>', ["body 'left_upper'", "<attach>", "save the whole model"]),
    ("xml", LEFT, LEFT + '<include file="two_armed.xml"/>', ["<include>", "there is no such file"]),
    ("xml", LEFT, LEFT + '<include file="damaged.xml"/>', ["<include> 'damaged.xml': a file includes itself"]),
    ("xml", 'class="touched" type="box"', 'class="tuched" type="box"', ["body 'left_lower'", "unknown default class"]),
    ("xml", 'name="right_wrist"', 'name="right_slide"', ["repeated name 'right_slide'"]),
    # YAML
    ("yaml", "{name: left_hand, mass: 1.0,", "{name: left_hand, mass: -1.0,", ["link 'left_hand': mass is -1 kg"]),
    ("yaml", "{name: left_hand, mass: 1.0,", "{name: left_hand, mas: 1.0,", ["mas", "did you mean 'mass'?"]),
    ("yaml", "yy: 0.4, zz: 0.45", "yy: 0.4, zz: 0.9", ["link 'left_upper'", "break the triangle inequality"]),
    ("yaml", "axis: [1, 0, 1]", "axis: [0, 0, 0]", ["joint 'left_wrist': axis [0.0, 0.0, 0.0] has length zero"]),
    ("yaml", "child: left_hand", "child: left_hnd", ["joint 'left_wrist': child link 'left_hnd' does not exist"]),
    ("yaml", "parent: left_slide", "parent: left_hand", ["link 'left_hand'", "loop"]),
    ("yaml", "type: fixed", "type: welded", ["joints", "type", "welded"]),
    ("yaml", "position: [0.5, 0, 0]", "position: [.inf, 0, 0]", ["joint 'left_wrist': position [inf"]),
    ("yaml", "com: [0, 0, 0.5]", "com: [0, 0, 1e9]", ["link 'antenna': centre of mass", "is farther than 1e+06 m"]),
    ("yaml", "mass: 30.0", "mass: heavy", ["mass", "heavy"]),
]  # fmt: skip


def refusal(path) -> str:
    """The message of the refusal: one line, and soon."""
    with within(SECONDS), pytest.raises(InputError) as caught:
        jffsr.load_robot(path)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_there_are_enough_damaged_files():
    assert len(DAMAGED) >= 40
    assert {suffix for suffix, *_ in DAMAGED} == {"urdf", "xml", "yaml"}


@pytest.mark.parametrize(("suffix", "good", "bad", "words"), DAMAGED, ids=lambda value: None)
def test_a_damaged_file_is_refused_with_file_body_and_reason(folder, suffix, good, bad, words):
    text = TEXTS[suffix]
    assert text.count(good) >= 1
    path = folder / f"damaged.{suffix}"
    path.write_text(text.replace(good, bad, 1), encoding="utf-8")
    message = refusal(path)
    assert message.count("MuJoCo does not accept it") <= 1
    assert message.count(path.name) == 1 or "<include>" in message
    at = 0
    for word in [f"damaged.{suffix}", *words]:
        assert word in message[at:], f"{word!r} is not in, or not in this order: {message}"
        at = message.index(word, at)
    assert sorted(entry.name for entry in folder.iterdir()) == [path.name, "meshes"]


# Published inertia tensors (xx, yy, zz, xz) of links 2, 3 and 5 of ETS-VII's arm, kg m^2, which no rigid body has:
# K. Yoshida, S. Abiko, AIAA 2002-4568, as transcribed in D. Dimitrov's Basic Multibody Simulator, model_ETS7.m.
ETS_VII = {
    "link2": (22.45, 0.102, 3.378, 3.752, -0.00214),
    "link3": (21.89, 0.4327, 2.266, 2.528, -0.6328),
    "link5": (26.0, 0.5727, 0.5987, 0.1290, -0.2313),
}


@pytest.mark.parametrize("suffix", ["urdf", "xml", "yaml"])
@pytest.mark.parametrize("name", sorted(ETS_VII))
def test_published_tensors_that_are_impossible_are_refused(folder, name, suffix):
    mass, xx, yy, zz, xz = ETS_VII[name]
    parts = {
        "urdf": f"""<robot name="ets7"><link name="base"><inertial><mass value="2552"/>
            <inertia ixx="6206" ixy="48.16" ixz="78.52" iyy="3541" iyz="-29.22" izz="7087"/></inertial></link>
            <link name="{name}"><inertial><mass value="{mass}"/>
            <inertia ixx="{xx}" ixy="0" ixz="{xz}" iyy="{yy}" iyz="0" izz="{zz}"/></inertial></link>
            <joint name="j" type="continuous"><parent link="base"/><child link="{name}"/></joint></robot>""",
        "xml": f"""<mujoco><worldbody><body name="base">
            <inertial pos="0 0 0" mass="2552" fullinertia="6206 3541 7087 48.16 78.52 -29.22"/>
            <body name="{name}"><joint name="j"/>
            <inertial pos="0 0 0" mass="{mass}" fullinertia="{xx} {yy} {zz} 0 {xz} 0"/></body></body>
            </worldbody></mujoco>""",
        "yaml": f"""
name: ets7
base: {{name: base, mass: 2552.0, inertia: {{xx: 6206, yy: 3541, zz: 7087, xy: 48.16, xz: 78.52, yz: -29.22}}}}
links: [{{name: {name}, mass: {mass}, inertia: {{xx: {xx}, yy: {yy}, zz: {zz}, xz: {xz}}}}}]
joints: [{{name: j, type: revolute, parent: base, child: {name}, axis: [0, 0, 1]}}]
""",
    }
    path = folder / f"ets7.{suffix}"
    path.write_text(parts[suffix], encoding="utf-8")
    message = refusal(path)
    assert f"ets7.{suffix}" in message
    assert f"'{name}'" in message
    assert "triangle inequality" in message or "A + B >= C" in message


HOSTILE = {
    "entity bomb": (
        '<!DOCTYPE robot [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">'
        '<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]><robot name="&c;"/>',
        ":1: the entity 'a' is declared; entities are not allowed",
    ),
    "outside entity": (
        '<!DOCTYPE robot [<!ENTITY a SYSTEM "file:///etc/passwd">]>\n<robot name="&a;"/>',
        ":1: the entity 'a' is declared; entities are not allowed",
    ),
    "deep nesting": ("<mujoco><worldbody>" + "<body>" * 100_000, ":1: elements stand more than 400 deep"),
    "huge": ("<robot>" + " " * 10_000_000, "the file is larger than 10,000,000 bytes"),
    "empty": ("", ":1: this is not well-formed XML (no element found)"),
    "two roots": ("<robot/>\n<robot/>", ":2: this is not well-formed XML (junk after document element)"),
    "zero byte": ("<robot name='a\x00b'/>", ":1: this is not well-formed XML"),
    "undeclared prefix and bomb of attributes": (
        "<robot " + " ".join(f'a{i}="1"' for i in range(100_000)) + "/>",
        "the robot has no link",
    ),
    "no link": ("<robot/>", "the robot has no link"),
    "no body": ("<mujoco/>", "there is no body in <worldbody>"),
    "one body": ('<mujoco><worldbody><body name="a"><geom size="1"/></body></worldbody></mujoco>', "no revolute or"),
    "something else": ("<html><body/></html>", ":1: the first element is <html>; <robot> (URDF) or <mujoco> (MJCF)"),
    "links without end": ("<robot>" + '<link name="a"/>' * 50_000 + "</robot>", "more than 1000 links or joints"),
    "bodies without end": (
        "<mujoco><worldbody>" + "<body/>" * 50_000 + "</worldbody></mujoco>",
        "there are more than 1000 bodies",
    ),
    "elements without end": ("<mujoco>" + "<a/>" * 200_000 + "</mujoco>", "there are more than 100,000 elements"),
    "an include that bites its tail": ('<mujoco>\n<include file="hostile.xml"/></mujoco>', "a file includes itself"),
}  # fmt: skip


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_file_is_refused_soon(folder, case):
    text, words = HOSTILE[case]
    path = folder / "hostile.xml"
    path.write_text(text, encoding="utf-8")
    message = refusal("hostile.xml")
    assert message.startswith("hostile.xml")
    assert words in message
    assert len(message) < 400


def test_a_fan_of_included_files_is_refused_soon(folder):
    """Each file includes the next ten times: ten thousand million files, if somebody let it."""
    for level in range(10):
        inside = f'<include file="{level + 1}.xml"/>' * 10
        (folder / f"{level}.xml").write_text(f"<mujoco>{inside}</mujoco>")
    (folder / "10.xml").write_text("<mujoco/>")
    assert "at most 100 files can be included" in refusal("0.xml")
    (folder / "1.xml").write_text(f"<mujoco>{' ' * 2_000_000}</mujoco>")
    assert "1.xml: the file is larger than" in refusal("0.xml")


def test_what_is_no_text_file_is_refused(folder):
    (folder / "folder.urdf").mkdir()
    assert "this is a folder, a URDF or MJCF file is expected" in refusal(folder / "folder.urdf")
    (folder / "bytes.urdf").write_bytes(b"<robot>\n\xff\xfe</robot>")
    assert "bytes.urdf:2: the file is not UTF-8 text (byte 0xff)" in refusal(folder / "bytes.urdf")
    os.mkfifo(folder / "pipe.xml")
    assert "this is not a regular file, a URDF or MJCF file is expected" in refusal(folder / "pipe.xml")
    assert "there is no such file" in refusal(folder / "gone.mjcf")


def test_loading_is_quick(folder):
    """Work grows no faster than the file: a chain of 300 links loads, in both forms."""
    links = "".join(
        f'<link name="l{i}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
        "</inertial></link>" for i in range(300)
    )  # fmt: skip
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/></joint>'
        for i in range(299)
    )  # fmt: skip
    (folder / "long.urdf").write_text(f'<robot name="long">{links}{joints}</robot>')
    with within(SECONDS):
        robot = jffsr.load_robot(folder / "long.urdf")
        jffsr.save_robot(robot, folder / "long.xml")
        assert jffsr.load_robot(folder / "long.xml").num_joints == 299
