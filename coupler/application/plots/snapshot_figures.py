# SPDX-License-Identifier: GPL-2.0-or-later
"""Pictures of the evolving interface: finite elements, overlap, particles, broken bonds, tool."""
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle

from results_file import Snapshots, Unreadable, sigma_star

STRESS_COLOURS = LinearSegmentedColormap.from_list("stress", ["#f4f7fa", "#b5cfe3", "#5b93c0", "#1f5488", "#0b2547"])
DAMAGE_COLOURS = LinearSegmentedColormap.from_list("damage", ["#f0dfb8", "#f2a93b", "#d1421f", "#5c0a10"])
OVERLAP_COLOUR, TOOL_COLOUR, BREAK_COLOUR = "#8e44ad", "#c3c8cf", "#111111"
POLYGON_ORDER = [0, 1, 3, 2]  # corners of a cell are stored in lexicographic order
HEADROOM = 0.3  # height shown above the rock, as a fraction of the height of the rock that is shown
MILLI = 1e3


def chosen(names):
    """All of up to four snapshots, else four or six of equal distance with the last one."""
    count = len(names) if len(names) <= 4 else 4 if len(names) == 5 else 6
    return [names[i] for i in np.linspace(0, len(names) - 1, count).round().astype(int)]


def rock_box(snapshots, drawn):
    """(lower, upper) of the rock: the mesh, or the particles when there is no mesh."""
    points = snapshots.nodes if len(snapshots.nodes) else drawn[0].position
    if not len(points):
        raise Unreadable(f"{snapshots.directory}/fields: neither a mesh nor particles")
    return points[:, :2].min(axis=0), points[:, :2].max(axis=0)


def work_box(snapshots, drawn):
    """(lower, upper) of the part of the rock with converted cells, broken bonds and the tip of the tool."""
    lower, upper = rock_box(snapshots, drawn)
    points = [np.empty((0, 2))]
    last = drawn[-1]
    if not any(len(snapshot.radius) for snapshot in drawn):  # finite elements alone: their stress is all there is to see
        return lower, upper
    if len(last.platens):  # a specimen is shown with its platens
        margin = 0.06 * (upper - lower).max()
        return lower - margin, upper + margin
    if len(snapshots.cells) and np.any(last.alpha >= 1.):
        touched = snapshots.cells[last.alpha < 1.]
        points.append(snapshots.nodes[touched.ravel(), :2])
    if len(last.broken):
        points.append(np.percentile(last.broken[:, :2], [1, 99], axis=0))
    for snapshot in drawn:
        if snapshot.tool_radius > 0.:
            tip = snapshot.tool_center[:2] - [0., snapshot.tool_radius]
            points += [[tip - [0.2 * snapshot.tool_radius, 0.]], [tip + [0.2 * snapshot.tool_radius, 0.]]]
    points = np.clip(np.concatenate(points), lower, upper)
    if not len(points):
        return lower, upper
    # Some rock around it, and enough for a panel that is not too narrow.
    low, high = points.min(axis=0), np.array([points[:, 0].max(), upper[1]])
    margin = 0.12 * (high - low).max()
    low, high = low - margin, high + [margin, 0.]
    low[1] = min(low[1], high[1] - 0.3 * (high[0] - low[0]))
    widen = 0.5 * max(1.2 * (high[1] - low[1]) - (high[0] - low[0]), 0.)
    return np.maximum(low - [widen, 0.], lower), np.minimum(high + [widen, 0.], upper)


def cell_polygons(snapshots, snapshot, cells):
    """Deformed corners of cells, in mm; of a hexahedron its back face."""
    moved = (snapshots.nodes + snapshot.displacement)[:, :2] * MILLI
    return moved[snapshots.cells[cells][:, POLYGON_ORDER]]


def cells_in_view(snapshots):
    """All cells, in three dimensions those cut by the middle plane of z."""
    if not snapshots.solid:
        return np.ones(len(snapshots.cells), bool)
    z = snapshots.nodes[:, 2]
    middle, of_cells = 0.5 * (z.min() + z.max()), z[snapshots.cells]
    return (of_cells.min(axis=1) <= middle) & (of_cells.max(axis=1) > middle)


def draw_cells(axis, snapshots, snapshot, colours):
    shown = np.nonzero((snapshot.alpha > 0.) & cells_in_view(snapshots))[0]
    if not len(shown):
        return
    fill = colours.to_rgba(np.nan_to_num(snapshot.stress[shown]) / 1e6)
    # The tint of a cell in the overlap shows its weight.
    alpha = snapshot.alpha[shown, None]
    fill[:, :3] = alpha * fill[:, :3] + (1. - alpha)
    axis.add_collection(PolyCollection(cell_polygons(snapshots, snapshot, shown), facecolors=fill, edgecolors="#a9b4bf",
                                       linewidths=0.25, zorder=1))


def draw_overlap(axis, snapshots, snapshot):
    overlap = np.nonzero((snapshot.alpha > 0.) & (snapshot.alpha < 1.) & cells_in_view(snapshots))[0]
    if len(overlap):
        axis.add_collection(PolyCollection(cell_polygons(snapshots, snapshot, overlap), facecolors="none",
                                           edgecolors=OVERLAP_COLOUR, linewidths=0.5, zorder=3))


def draw_discs(axis, position, diameter, **style):
    """Discs true to size, positions and diameters in m."""
    axis.add_collection(EllipseCollection(diameter * MILLI, diameter * MILLI, np.zeros(len(position)), units="xy",
                                          offsets=position[:, :2] * MILLI, transOffset=axis.transData, **style))


def draw_particles(axis, snapshot, colours):
    if len(snapshot.radius):
        fill = colours.to_rgba(snapshot.damage)
        fill[:, 3] = 0.25 + 0.75 * np.clip(snapshot.weight, 0., 1.)
        edge = np.column_stack([np.tile([0.35, 0.27, 0.15], (len(fill), 1)), 0.6 * fill[:, 3]])
        draw_discs(axis, snapshot.position, 2. * snapshot.radius, facecolors=fill, edgecolors=edge, linewidths=0.15, zorder=2)
    if len(snapshot.broken):
        size = 0.5 * np.median(snapshot.radius) if len(snapshot.radius) else 0.
        draw_discs(axis, snapshot.broken, np.full(len(snapshot.broken), size), facecolors=BREAK_COLOUR, edgecolors="none",
                   zorder=4)


def draw_snapshot(axis, snapshots, snapshot, box, colours):
    draw_cells(axis, snapshots, snapshot, colours[0])
    draw_particles(axis, snapshot, colours[1])
    draw_overlap(axis, snapshots, snapshot)
    if snapshot.tool_radius > 0.:
        axis.add_patch(Circle(snapshot.tool_center[:2] * MILLI, snapshot.tool_radius * MILLI, facecolor=TOOL_COLOUR,
                              edgecolor="#3b3f45", linewidth=1.2, zorder=5))
    lower, upper = box[0] * MILLI, box[1] * MILLI
    head = 0. if len(snapshot.platens) else HEADROOM * (upper[1] - lower[1])
    if len(snapshot.platens):
        for y, end in zip(snapshot.platens * MILLI, (lower[1], upper[1])):
            axis.add_patch(Rectangle((lower[0], y), upper[0] - lower[0], end - y, facecolor=TOOL_COLOUR, edgecolor="#3b3f45",
                                     linewidth=1.2, zorder=5))
    # Only the lower part of the tool is shown, since it is usually much larger than the rock.
    axis.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1] + head), aspect="equal")
    count = f"{snapshot.total:,}".replace(",", "\u202f")
    cut = f", {len(snapshot.radius)} cut by z = {snapshots.middle * MILLI:.3g} mm" if snapshots.solid else ""
    axis.set_title(f"t = {snapshot.time * MILLI:.3g} ms,  {count} particles{cut}", fontsize=9 if cut else None)


def colour_scales(drawn, threshold):
    """Shared by all pictures of a run: stress up to the value that nearly all cells stay below, or sigma* when that is near;
    damage from 0 to 1."""
    stress = np.concatenate([s.stress[(s.alpha > 0.) & np.isfinite(s.stress)] for s in drawn]) / 1e6
    top = np.percentile(stress, 99.5) if len(stress) else 1.
    if threshold is not None and top < threshold / 1e6 < 3. * top:
        top = threshold / 1e6
    return (ScalarMappable(Normalize(0., top if top > 0. else 1.), STRESS_COLOURS),
            ScalarMappable(Normalize(0., 1.), DAMAGE_COLOURS))


def place_panels(count, columns, ratio, width, highest):
    """Figure, axes and the height of the strip below them for panels of one height/width ratio; all lengths in inches.
    By hand, since matplotlib's layouts cut titles off when panels of fixed aspect share colour bars."""
    left, right, top, gap_x, gap_y, strip = 0.8, 0.3, 0.4, 0.4, 0.5, 1.6
    rows = -(-count // columns)
    panel = (width - left - right - (columns - 1) * gap_x) / columns
    panel = min(panel, (highest - top - strip - (rows - 1) * gap_y) / (rows * ratio))
    # A narrow rock is centred; the colour bars need their width.
    needed = left + right + columns * panel + (columns - 1) * gap_x
    width = max(needed, min(width, 9.))
    left += 0.5 * (width - needed)
    height = top + strip + rows * panel * ratio + (rows - 1) * gap_y
    figure = plt.figure(figsize=(width, height))
    axes = []
    for i in range(count):
        row, column = divmod(i, columns)
        x, y = left + column * (panel + gap_x), height - top - (row + 1) * panel * ratio - row * gap_y
        axis = figure.add_axes([x / width, y / height, panel / width, panel * ratio / height])
        axis.tick_params(labelleft=column == 0, labelbottom=i + columns >= count)
        axis.set_ylabel("y [mm]" if column == 0 else "")
        axis.set_xlabel("x [mm]" if i + columns >= count else "")
        axes.append(axis)
    return figure, axes


def draw_keys(figure, drawn, colours, threshold):
    """The colour bars that are needed and the legend of the marks, in one line below the panels."""
    has_cells, has_particles = any(np.any(s.alpha > 0.) for s in drawn), any(len(s.radius) for s in drawn)
    bars = [entry for entry, used in (((colours[0], "stress measure of activation [MPa]", "max"), has_cells),
                                      ((colours[1], "damage: broken / stored bonds [-]", "neither"), has_particles)) if used]
    marks = []
    if any(np.any((s.alpha > 0.) & (s.alpha < 1.)) for s in drawn):
        marks.append(Line2D([], [], color=OVERLAP_COLOUR, marker="s", markersize=8, markerfacecolor="none", linestyle="",
                            label="overlap"))
    if any(len(s.broken) for s in drawn):
        marks.append(Line2D([], [], color=BREAK_COLOUR, marker="o", markersize=4, linestyle="", label="broken bond"))
    height = figure.get_size_inches()[1]
    total = 0.36 * len(bars) + 0.05 * (len(bars) - 1) + (0.14 if marks else 0.)
    x = 0.5 - 0.5 * total
    for bar, label, extend in bars:
        scale = figure.colorbar(bar, cax=figure.add_axes([x, 0.62 / height, 0.36, 0.18 / height]), orientation="horizontal",
                                extend=extend, label=label)
        if bar is colours[0] and threshold is not None and bar.norm.vmin <= threshold / 1e6 <= bar.norm.vmax:
            scale.ax.axvline(threshold / 1e6, color=BREAK_COLOUR, linewidth=1.6)
            scale.ax.text(threshold / 1e6, 1.1, r"$\sigma^*$", ha="center", va="bottom", transform=scale.ax.get_xaxis_transform())
        x += 0.41
    if marks:
        figure.legend(handles=marks, loc="center left", bbox_to_anchor=(x - 0.02, 0.6 / height), frameon=False)


def snapshot_figure(path, snapshots, drawn, box, columns, dpi, colours):
    """Panels of equal scale with their keys below."""
    extent = (box[1] - box[0]) * [1., 1. + (0. if len(drawn[-1].platens) else HEADROOM)]
    figure, axes = place_panels(len(drawn), min(columns, len(drawn)), extent[1] / extent[0], 13., 15.)
    for axis, snapshot in zip(axes, drawn):
        draw_snapshot(axis, snapshots, snapshot, box, colours)
    draw_keys(figure, drawn, colours, sigma_star(snapshots.directory))
    figure.savefig(path, dpi=dpi)
    plt.close(figure)


def snapshot_figures(directory, output):
    """interface.png and final.png; returns which picture was left out and why, or None."""
    snapshots = Snapshots(directory)
    if not snapshots.names:
        return "there are no snapshots in fields/"
    drawn = [snapshots.read(name) for name in chosen(snapshots.names)]
    box = work_box(snapshots, drawn)
    wide, high = box[1] - box[0]
    colours = colour_scales(drawn, sigma_star(directory))  # the last snapshot is one of them
    snapshot_figure(output / "interface.png", snapshots, drawn, box, 3 if wide < 1.6 * high else 2, 150, colours)
    whole = box if len(drawn[-1].platens) else rock_box(snapshots, drawn)
    snapshot_figure(output / "final.png", snapshots, drawn[-1:], whole, 1, 200, colours)
    return None
