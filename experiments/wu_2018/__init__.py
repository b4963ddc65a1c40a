"""The tracking case of Wu et al. 2018 remade, and how far its errors fall at the same duration and peak rate."""
