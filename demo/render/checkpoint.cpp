#include "checkpoint.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <file.hpp>
#include <filesystem>
#include <program.hpp>
#include <stdexcept>
#include <string_view>

namespace cumulet::demo {
namespace {

constexpr std::string_view first_line = "Cumulet checkpoint 1";
constexpr std::string_view driver_name = "driver";

[[noreturn]] void refuse(const std::string& path, const std::string& cause) {
  throw std::runtime_error(path + ": " + cause);
}

/// Detects truncated or damaged files; it does not protect against manipulation.
std::string checksum(std::string_view bytes) {
  const std::uint64_t hash = fnv1a(bytes);
  std::string text(sizeof hash, '\0');
  std::memcpy(text.data(), &hash, sizeof hash);
  return text;
}

/// Removes the first line from `text` and returns it; nullopt if `text` contains no line end.
std::optional<std::string_view> take_line(std::string_view& text) {
  const auto end = text.find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end + 1);
  return line;
}

/// Parses the content of a checkpoint file; nullopt if it is incomplete or damaged.
std::optional<Checkpoint> parse(std::string_view text) {
  constexpr std::size_t sum = sizeof(std::uint64_t);
  if (text.size() < sum || checksum(text.substr(0, text.size() - sum)) != text.substr(text.size() - sum))
    return std::nullopt;
  text.remove_suffix(sum);
  if (take_line(text) != first_line) return std::nullopt;
  Checkpoint checkpoint;
  for (;;) {
    const auto line = take_line(text);
    if (!line) return std::nullopt;
    if (line->empty()) break;
    const auto equals = line->find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    std::string name(line->substr(0, equals));
    std::string value(line->substr(equals + 1));
    if (name == driver_name) {
      checkpoint.driver = std::move(value);
    } else {
      checkpoint.of.emplace_back(std::move(name), std::move(value));
    }
  }
  const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
  checkpoint.accumulation.assign(bytes.begin(), bytes.end());
  return checkpoint;
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 9).ptr};
}

}  // namespace

CheckpointOf checkpoint_of(const RenderOptions& options) {
  const cumulet_sampling_desc& sampling = options.scene.sampling;
  const bool volume = std::ranges::find(options.aovs, CUMULET_AOV_VOLUME) != options.aovs.end();
  return {{"version", version_text()},
          {"size", std::to_string(options.scene.width) + "x" + std::to_string(options.scene.height)},
          {"seed", std::to_string(sampling.seed)},
          {"first sample", std::to_string(sampling.first_sample)},
          {"number of samples", std::to_string(sampling.samples)},
          {"noise target", number_text(sampling.noise_target_percent)},
          {"sampling mode", sampling.adaptive == 1 ? "adaptive" : "even"},
          {"volume AOV", volume ? "with" : "without"},
          {"scene", scene_hash(options.scene)}};
}

void write_checkpoint(const std::string& path, const Checkpoint& checkpoint) {
  std::string text(first_line);
  text += '\n';
  const auto add = [&text](std::string_view name, const std::string& value) {
    text.append(name).append("=").append(one_line(value)).append("\n");
  };
  for (const auto& [name, value] : checkpoint.of) add(name, value);
  add(driver_name, checkpoint.driver);
  text += '\n';
  text.reserve(text.size() + checkpoint.accumulation.size() + std::size_t{64});
  text.append(reinterpret_cast<const char*>(checkpoint.accumulation.data()), checkpoint.accumulation.size());
  text += checksum(text);
  image::replace_file(path, text);
}

std::optional<Checkpoint> read_checkpoint(const std::string& path, const CheckpointOf& wanted) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) && !error) return std::nullopt;
  auto checkpoint = parse(image::read_file(path));
  if (!checkpoint) refuse(path, "is not a checkpoint of cumulet-render, or is damaged; delete it to start over");
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (i >= checkpoint->of.size() || checkpoint->of[i] != wanted[i])
      refuse(path, "is the checkpoint of another image: the " + wanted[i].first + " differs");
  }
  return checkpoint;
}

}  // namespace cumulet::demo
