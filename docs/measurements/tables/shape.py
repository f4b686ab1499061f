"""Other interpolations of the samples that tests/src/bin/shape.rs wrote: shape.py DIRECTORY [FIGURE], called by shape.sh."""

import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import LinearNDInterpolator, RBFInterpolator


def linear(places, heights, cells):
    """Linear interpolation in Delaunay triangles; the table beyond them."""
    return np.nan_to_num(LinearNDInterpolator(places, heights)(cells))


def plate(places, heights, cells):
    """The mean of a Gaussian process with a thin-plate kernel and noise."""
    return RBFInterpolator(places, heights, kernel="thin_plate_spline", smoothing=1)(cells)


WIDTH, HEIGHT, LEFT, BOTTOM, STYLES = 640, 340, 60, 290, {
    "explored": 'stroke="#1e6db4"',
    "random": 'stroke="#b4501e"',
}


def figure(table, path):
    """Draws the mean error of explored and random approaches from the rows of all objects."""
    lines = {}
    for row in table.splitlines():
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        if cells[0] == "**mean**":
            lines.setdefault(cells[1], []).append((int(cells[2]), float(cells[3])))
    most = max(after for points in lines.values() for after, _ in points)
    worst = np.ceil(max(error for points in lines.values() for _, error in points))
    place = lambda after, error: (LEFT + (WIDTH - 150) * after / most, BOTTOM - (BOTTOM - 30) * error / worst)
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="Helvetica, Arial, sans-serif" '
           'font-size="13" fill="#222"><title>Error of the map against approaches</title>'
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']
    for error in np.arange(0, worst + 0.1, 0.5):
        (x, y), (end, _) = place(0, error), place(most, error)
        svg.append(f'<path d="M{x} {y:.1f} H{end}" stroke="#ddd"/><text x="{x - 8}" y="{y + 4:.1f}" text-anchor="end">{error:g}</text>')
    for after, _ in next(iter(lines.values())):
        x, y = place(after, 0)
        svg.append(f'<text x="{x:.1f}" y="{y + 20:.1f}" text-anchor="middle">{after}</text>')
    svg.append(f'<text x="{LEFT}" y="18">mean height error, mm</text><text x="{WIDTH - 90}" y="{HEIGHT - 12}" text-anchor="end">approaches</text>')
    for aims, points in lines.items():
        at = [place(*point) for point in points]
        path_of = " L".join(f"{x:.1f} {y:.1f}" for x, y in at)
        svg.append(f'<path d="M{path_of}" fill="none" stroke-width="2" {STYLES[aims]}/>')
        svg += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="#fff" stroke-width="2" {STYLES[aims]}/>' for x, y in at]
        svg.append(f'<text x="{at[-1][0] + 12:.1f}" y="{at[-1][1] + 4:.1f}">{aims}</text>')
    Path(path).write_text("\n".join([*svg, "</svg>", ""]))


def main():
    """Prints a row for each kind of interpolation."""
    directory, sums = Path(sys.argv[1]), {}
    for truth in sorted(directory.glob("* truth.txt")):
        half_x, half_y, *heights = np.loadtxt(truth)
        true = np.array(heights)
        grid = np.meshgrid(np.arange(-half_x, half_x + 1), np.arange(-half_y, half_y + 1))
        cells = np.stack([axis.ravel() for axis in grid], axis=1)
        for path in sorted(directory.glob(f"{truth.name.split(' ')[0]} * *.txt")):
            _, aims, after = path.stem.split(" ")
            samples = np.loadtxt(path)
            samples = samples[samples[:, 3] > 0]
            _, first = np.unique(samples[:, :2].round(6), axis=0, return_index=True)
            places, met = samples[first, :2], samples[first, 2]
            for name, guess in (("linear", linear), ("thin plate", plate)):
                guessed = guess(places, met, cells)
                error = np.abs(guessed - true)[true > 0.5].mean()
                union = ((guessed > 1) & (true > 1)).sum() / ((guessed > 1) | (true > 1)).sum()
                sums.setdefault((name, aims, int(after)), []).append((error, union))
    print("\n| interpolation | aims | approaches | error, mm | IoU |\n|---|---|---|---|---|")
    for (name, aims, after), found in sorted(sums.items()):
        error, union = np.mean(found, axis=0)
        print(f"| {name} | {aims} | {after} | {error:.2f} | {union:.3f} |")
    if len(sys.argv) > 2:
        figure((directory / "ours").read_text(), sys.argv[2])


if __name__ == "__main__":
    main()
