"""A study file with every key explained: what `jaxident sweep --example` prints."""

EXAMPLE = """\
# How does camera noise spoil the paper's method? Run with: jaxident sweep study.toml --out study

name = "camera noise and excitation"
seeds = 50                  # repetitions of every combination below, each with its own random numbers

# Axes: every combination of their entries is run.
excitations = ["staircase", "multilevel"]       # also prbs, multisine, chirp
noise = [1e-6, 1e-5, 1e-4, 1e-3]                # standard deviation of the camera's position [m]
samples = [200]                                 # rows of a run
amplitude = [1.0]                               # largest command
# period = [0.0333, 0.1]                        # sample period [s]; default: that of the first robot
# effects = ["none", "turn_loss", { slope = [0.5, 2] }, { name = "sag", supply_sag = { resistance = 0.2 } }]
                            # what acts on every robot: an effect's name alone is its typical size, a number the
                            # strength in typical sizes, a list makes an entry of each; else give the parameters
                            # (`jaxident effects` lists them); several effects in one { } act together

hold = 5                    # samples that a level of the excitation lasts
# runs = 3                  # runs of a trial, each from rest under commands of its own; default: 1
heading_per_position = 10.0 # heading noise [rad] for each metre of position noise
# correlation_time = 0.5    # of the camera's noise [s]; default: white
# chunk = 2000              # trials that are computed and stored together: bounds the memory

[[robots]]
model = "published"         # a robot that comes with the program, or a model file
# scale = { dead_zone = [0.5, 1.0, 2.0], rate = 1.0 }     # grid: every combination becomes a robot
# spread = { gain = 0.2 }   # each seed draws its own robot, this far from the model at most (relative, uniform)
                            # scale and spread take rate, gain, coupling, dead_zone
# effects = [{}, { motor_lag = 0.5 }, { motor_lag = 1.0 }, { coulomb_friction = { right = 0.05, left = 0.04 } }]
                            # of this robot alone: each set becomes a robot; {} is the robot without

[[estimators]]
method = "batch"            # PAPER section VI
# name = "batch, free run"  # needed where a method stands here twice
# settings = { reading = "free_run", setup_samples = 200, d_max_share = 0.9 }

[[estimators]]
method = "recursive"        # batch on the setup time, then recursive least squares
settings = { setup_samples = 100 }              # also forgetting
                            # "maximum-likelihood" takes coupling = true, for robots whose speeds change each other
                            # (as those of "published" do), and wheels = false, which leaves wheel speeds aside;
                            # "diagnose" also names effects, and takes seconds a trial
"""
