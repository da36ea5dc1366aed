"""Tasks for reinforcement learning, one file each: subadmm.gym has them all."""
