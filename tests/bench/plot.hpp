#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace cumulet::bench {

/// Throws std::runtime_error that names the file.
void write_file(const std::filesystem::path& path, const std::string& text);

struct Series {
  std::string label;
  int color = 0;  ///< 0 to 3
  bool dashed = false;
  std::vector<std::pair<double, double>> points;
};

/// An SVG with logarithmic axes, light or dark as the reader's system. Points that are not positive are left out.
std::string line_plot(const std::string& title, const std::string& x_label, const std::string& y_label,
                      const std::vector<Series>& series);

struct BarGroup {
  std::string label;
  std::vector<double> values;  ///< one per bar
};

/// Horizontal bars from zero, in groups.
std::string bar_plot(const std::string& title, const std::string& value_label, const std::vector<std::string>& bars,
                     const std::vector<BarGroup>& groups);

}  // namespace cumulet::bench
