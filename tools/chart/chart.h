// SPDX-License-Identifier: Apache-2.0
// Charts of measured points, such as time against error, as a script for gnuplot. The axes are
// logarithmic; each point has its name beside it, and a line shows the Pareto front.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace volcomp {

/// One measurement.
struct ChartPoint {
    std::string name;    ///< drawn beside the point; may be empty
    double x = 1, y = 1; ///< > 0: both axes are logarithmic
};

/// Points of one colour, with their name in the key.
struct ChartSeries {
    std::string name;   ///< in the key; an empty one is not shown
    bool line = false;  ///< joined in their order
    bool right = false; ///< against the axis on the right
    std::vector<ChartPoint> points;
    bool apart = false; ///< not to be compared with the others: not on the Pareto front; hollow
};

/// One pair of axes with its series.
struct ChartPanel {
    std::string title, x_label, y_label, right_label;
    std::vector<ChartSeries> series;
    bool front = false;            ///< draws the Pareto front of all points
    std::string key = "top right"; ///< where the key is, in gnuplot's words
    /// Left, top, width and height of the axes, in parts of the page.
    std::array<double, 4> place{0, 0, 1, 1};
};

/// Returns the indices of the points that no other beats in both x and y, by rising x; of equal
/// points the first.
std::vector<std::size_t> paretoFront(const std::vector<ChartPoint>& points);

/// Returns the index of the point of the smallest x among those whose y is at most `limit`; -1 if
/// there is none.
int cheapestWithin(const std::vector<ChartPoint>& points, double limit);

/// A box of pixels around a text.
struct LabelBox {
    double x = 0, y = 0, width = 0, height = 0; ///< top left corner
};

/// Returns where the names of points go, so that they cover as little of each other and of the
/// points as possible. `marks` are the points in pixels; all boxes lie inside `frame`. The box of
/// an empty name has no width. Names rather do not lie on `lines`, points of lines.
std::vector<LabelBox> placeLabels(const std::vector<std::array<double, 2>>& marks,
                                  const std::vector<std::string>& names, const LabelBox& frame,
                                  double character_width, double line_height,
                                  const std::vector<std::array<double, 2>>& lines = {});

/// Returns a gnuplot script that draws the panels to `output` (.svg or .png) on a page of width x
/// height pixels. Points at or below 0 are left out.
std::string gnuplotScript(const std::vector<ChartPanel>& panels, int width, int height,
                          const std::string& output);

} // namespace volcomp
