#include "plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "format.hpp"

namespace cumulet::bench {

namespace {

constexpr double width = 720.0;
constexpr double left = 110.0;
constexpr double right = 20.0;
constexpr double top = 44.0;

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else if (c == '>') {
      result += "&gt;";
    } else if (c == '"') {
      result += "&quot;";
    } else {
      result += c;
    }
  }
  return result;
}

std::string text_at(double x, double y, const char* anchor, const std::string& text, const char* more = "") {
  return format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" %s>", x, y, anchor, more) + escaped(text) + "</text>\n";
}

/// The header with the colors of both schemes, after Okabe and Ito, which are distinct for color-blind readers.
std::string head(double height, const std::string& title) {
  std::string svg = format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 %.0f %.0f\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n",
      width, height, width, height);
  svg +=
      "<style>\n"
      ".paper{fill:#ffffff} text{fill:#1b1f24} .axis{stroke:#57606a;fill:none} .rule{stroke:#d0d7de;fill:none}\n"
      ".line0{stroke:#b35900} .line1{stroke:#005f99} .line2{stroke:#1b1f24} .line3{stroke:#00795a}\n"
      ".fill0{fill:#b35900} .fill1{fill:#005f99} .fill2{fill:#57606a} .fill3{fill:#00795a}\n"
      "@media (prefers-color-scheme: dark){\n"
      ".paper{fill:#0d1117} text{fill:#e6edf3} .axis{stroke:#8b949e} .rule{stroke:#30363d}\n"
      ".line0{stroke:#f0a850} .line1{stroke:#56b4e9} .line2{stroke:#e6edf3} .line3{stroke:#3fc89b}\n"
      ".fill0{fill:#f0a850} .fill1{fill:#56b4e9} .fill2{fill:#8b949e} .fill3{fill:#3fc89b}\n"
      "}\n</style>\n";
  svg += format("<rect class=\"paper\" width=\"%.0f\" height=\"%.0f\"/>\n", width, height);
  svg += text_at(left, 24.0, "start", title, "font-weight=\"bold\" font-size=\"15\"");
  return svg;
}

struct LogAxis {
  double low = 1.0;
  double high = 10.0;
  double from = 0.0;
  double to = 1.0;
  [[nodiscard]] double position_of(double value) const {
    return from + (to - from) * std::log(value / low) / std::log(high / low);
  }
  /// 1, 2, 5 times powers of ten, or only the powers if there would be too many.
  [[nodiscard]] std::vector<double> ticks() const {
    const bool crowded = std::log10(high / low) > 2.6;
    std::vector<double> result;
    for (double decade = std::pow(10.0, std::floor(std::log10(low))); decade <= high; decade *= 10.0) {
      for (const double factor : {1.0, 2.0, 5.0}) {
        const double value = factor * decade;
        if (value >= low * 0.999 && value <= high * 1.001 && (!crowded || factor == 1.0)) result.push_back(value);
      }
    }
    return result;
  }
};

std::string short_number(double value) {
  if (value >= 1e9) return format("%.4gG", value / 1e9);
  if (value >= 1e6) return format("%.4gM", value / 1e6);
  if (value >= 1e3) return format("%.4gk", value / 1e3);
  return format("%.4g", value);
}

}  // namespace

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

std::string line_plot(const std::string& title, const std::string& x_label, const std::string& y_label,
                      const std::vector<Series>& series) {
  constexpr double height = 460.0;
  constexpr double bottom = 62.0;
  LogAxis x{1e300, 0.0, left, width - right};
  LogAxis y{1e300, 0.0, height - bottom, top};
  for (const Series& s : series) {
    for (const auto& [a, b] : s.points) {
      if (!(a > 0.0) || !(b > 0.0)) continue;
      x.low = std::min(x.low, a / 1.15);
      x.high = std::max(x.high, a * 1.15);
      y.low = std::min(y.low, b / 1.15);
      y.high = std::max(y.high, b * 1.15);
    }
  }
  if (x.high <= x.low) x = {1.0, 10.0, x.from, x.to};
  if (y.high <= y.low) y = {1.0, 10.0, y.from, y.to};
  std::string svg = head(height, title);
  for (const double tick : x.ticks()) {
    const double at = x.position_of(tick);
    svg += format("<line class=\"rule\" x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n", at, y.from, at, y.to);
    svg += text_at(at, y.from + 18.0, "middle", short_number(tick));
  }
  for (const double tick : y.ticks()) {
    const double at = y.position_of(tick);
    svg += format("<line class=\"rule\" x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n", x.from, at, x.to, at);
    svg += text_at(x.from - 8.0, at + 4.0, "end", short_number(tick));
  }
  svg += format("<path class=\"axis\" d=\"M%.1f %.1fV%.1fH%.1f\"/>\n", x.from, y.to, y.from, x.to);
  svg += text_at(0.5 * (x.from + x.to), height - 16.0, "middle", x_label);
  svg += format("<g transform=\"translate(24 %.1f) rotate(-90)\">", 0.5 * (y.from + y.to));
  svg += text_at(0.0, 0.0, "middle", y_label) + "</g>\n";
  // Where rising or falling lines leave space.
  const bool rises =
      std::ranges::count_if(
          series,
          [](const Series& s) { return !s.points.empty() && s.points.back().second > s.points.front().second; }) *
          2 >
      static_cast<std::ptrdiff_t>(series.size());
  const double legend_from = rises ? x.from + 18.0 : x.to - 212.0;
  double legend = y.to + 18.0;
  for (const Series& s : series) {
    const char* dash = s.dashed ? " stroke-dasharray=\"7 5\"" : "";
    std::string path;
    std::string dots;
    for (const auto& [a, b] : s.points) {
      if (!(a > 0.0) || !(b > 0.0)) continue;
      path += format("%c%.1f %.1f", path.empty() ? 'M' : 'L', x.position_of(a), y.position_of(b));
      dots += format("<circle class=\"fill%d\" cx=\"%.1f\" cy=\"%.1f\" r=\"3\"/>", s.color, x.position_of(a),
                     y.position_of(b));
    }
    if (!path.empty()) {
      svg += format("<path class=\"line%d\" fill=\"none\" stroke-width=\"2\"%s d=\"", s.color, dash) + path + "\"/>\n";
    }
    svg += dots + "\n";
    svg += format("<line class=\"line%d\" stroke-width=\"2\"%s x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n",
                  s.color, dash, legend_from, legend - 4.0, legend_from + 36.0, legend - 4.0);
    svg += text_at(legend_from + 44.0, legend, "start", s.label);
    legend += 19.0;
  }
  return svg + "</svg>\n";
}

std::string bar_plot(const std::string& title, const std::string& value_label, const std::vector<std::string>& bars,
                     const std::vector<BarGroup>& groups) {
  constexpr double bar = 18.0;
  constexpr double gap = 16.0;
  const double group_height = bar * static_cast<double>(bars.size()) + gap;
  const double bottom = top + 22.0 + group_height * static_cast<double>(groups.size());
  const double height = bottom + 34.0;
  double most = 0.0;
  for (const BarGroup& group : groups) {
    for (const double value : group.values) most = std::max(most, value);
  }
  if (!(most > 0.0)) most = 1.0;
  std::string svg = head(height, title);
  double legend = left;
  for (std::size_t i = 0; i < bars.size(); ++i) {
    svg +=
        format("<rect class=\"fill%zu\" x=\"%.1f\" y=\"%.1f\" width=\"12\" height=\"12\"/>\n", i % 4, legend, top - 10);
    svg += text_at(legend + 17.0, top, "start", bars[i]);
    legend += 32.0 + 8.0 * static_cast<double>(bars[i].size());
  }
  const double room = width - left - right - 64.0;
  double y = top + 22.0;
  for (const BarGroup& group : groups) {
    svg += text_at(left - 8.0, y + 0.5 * (group_height - gap) + 4.0, "end", group.label);
    for (std::size_t i = 0; i < group.values.size(); ++i) {
      const double length = std::max(0.0, room * group.values[i] / most);
      svg += format("<rect class=\"fill%zu\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n", i % 4, left, y,
                    length, bar - 3.0);
      svg += text_at(left + length + 6.0, y + 12.0, "start", short_number(group.values[i]), "font-size=\"12\"");
      y += bar;
    }
    y += gap;
  }
  svg += format("<line class=\"axis\" x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n", left, top + 16.0, left,
                bottom);
  svg += text_at(left, height - 12.0, "start", value_label);
  return svg + "</svg>\n";
}

}  // namespace cumulet::bench
