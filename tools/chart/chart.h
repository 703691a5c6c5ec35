// Charts of measured points (time against error), as a script for gnuplot: log scales, the Pareto
// front, each point with its name.
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
    std::string name;   ///< in the key; empty: not there
    bool line = false;  ///< joined in their order
    bool right = false; ///< against the axis on the right
    std::vector<ChartPoint> points;
};

/// One pair of axes with its series.
struct ChartPanel {
    std::string title, x_label, y_label, right_label;
    std::vector<ChartSeries> series;
    bool front = false;            ///< draws the Pareto front of all points
    std::string key = "top right"; ///< where the key goes, in gnuplot's words
    std::array<double, 4> place{
        0, 0, 1, 1}; ///< left, top, width and height of the axes, in parts of the page
};

/// Those points that no other beats in both x and y, by rising x. Of equal points the first.
std::vector<std::size_t> paretoFront(const std::vector<ChartPoint>& points);

/// The point of the smallest x among those whose y is at most `limit`; -1 where there is none.
int cheapestWithin(const std::vector<ChartPoint>& points, double limit);

/// A box of pixels around a text.
struct LabelBox {
    double x = 0, y = 0, width = 0, height = 0; ///< top left corner
};

/// Where the names of points go, so that they cover neither each other nor a point where that can
/// be helped. `marks` are the points in pixels; all boxes lie inside `frame`. An empty name has a
/// box without width.
std::vector<LabelBox> placeLabels(const std::vector<std::array<double, 2>>& marks,
                                  const std::vector<std::string>& names, const LabelBox& frame,
                                  double character_width, double line_height);

/// A gnuplot script that draws the panels to `output` (.svg or .png) on a page of width x height
/// pixels. Points at or below 0 are left out.
std::string gnuplotScript(const std::vector<ChartPanel>& panels, int width, int height,
                          const std::string& output);

} // namespace volcomp
