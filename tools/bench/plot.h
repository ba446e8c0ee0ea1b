// A picture of what a benchmark found: curves over one axis.
#pragma once

#include <string>
#include <vector>

namespace relmap::bench {

struct Curve {
  std::string name;
  std::vector<double> x, y;  // as many; only what is finite is drawn
  bool dots = false;         // else a line
};

struct Plot {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;  // values must be positive
  std::vector<Curve> curves;
};

// One value for each step, from 0.
Curve curve_by_step(std::string name, std::vector<double> y);

// By the name's end: .png, else scalable vector graphics; an empty name: nothing. Throws StatusError (IO_ERROR).
void save_plot(const Plot& plot, const std::string& path);

}  // namespace relmap::bench
