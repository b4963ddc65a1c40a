"""The same motion in MuJoCo and MJX, as independent witnesses."""
