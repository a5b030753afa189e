"""What errs before and after: judge.py BEFORE.csv AFTER.csv, as measure.py writes them.

The table that was loaded holds the means of the first readings, so that afterwards the slide errs by
the noise of those means, and by nothing else. Ends with 0 if it does."""
import csv
import math
import statistics
import sys


def means(path, column):
    found = {}
    with open(path) as rows:
        for row in csv.DictReader(rows):
            key = (float(row["target"]), row["direction"])
            value = float(row["position"]) - key[0] if column == "read" else float(row["error"])
            found.setdefault(key, []).append(1e3 * value)
    return found


def span(values):
    return max(values) - min(values)


def main():
    before, after = (means(path, "true") for path in sys.argv[1:3])
    read = means(sys.argv[1], "read")
    runs = min(len(v) for v in read.values())
    scatter = math.sqrt(statistics.fmean(statistics.variance(v) for v in read.values()))
    of_mean = scatter / math.sqrt(runs)
    was = {key: statistics.fmean(v) for key, v in before.items()}
    left = {key: statistics.fmean(v) for key, v in after.items()}
    # The first measurement's means less the truth at that time.
    noise = {key: statistics.fmean(read[key]) - was[key] for key in was}
    rms = math.sqrt(statistics.fmean(v * v for v in left.values()))
    unexplained = max(abs(left[key] + noise[key]) for key in left)
    print("systematic error E   %8.3f um before, %6.3f um after" % (span(was.values()), span(left.values())))
    print("error left, rms      %8.3f um; noise of a mean of %d readings %.3f um" % (rms, runs, of_mean))
    print("beyond that noise    %8.3f um at most" % unexplained)
    # Rounding of the file and of the motor (0.001 um), and the screw's slope over the correction:
    # 12 um/300 mm and 4 um waves of 130 mm give 0.00023 of at most 20 um.
    explained = unexplained <= 0.01
    # Of n means the rms is within 4/sqrt(2 n) of one with near certainty.
    near = abs(rms / of_mean - 1.0) < 4.0 / math.sqrt(2.0 * len(left))
    print("what is left is the noise" if explained and near else "what is left is NOT the noise")
    sys.exit(0 if explained and near else 1)


main()
