"""The same motion in MuJoCo and in MJX, two independent witnesses, driven by joint torques alone."""
