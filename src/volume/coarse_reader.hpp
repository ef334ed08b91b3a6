#pragma once

// Private to volume/: low-resolution proxies of a file's grids.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "volume/import_detail.hpp"
#include "volume/proxy.hpp"

namespace cumulet::volume::detail {

/// Reads each scalar grid at the reduced resolution of Proxy. Keeps the tree of the first grid for the
/// full-resolution reader.
class CoarseReader final : public Reader {
 public:
  /// whole: a reader with streams(). read() throws if the first grid has fewer bricks than min_bricks.
  CoarseReader(Reader& whole, std::uint64_t min_bricks, Progress* progress)
      : whole_(whole), min_bricks_(min_bricks), progress_(progress) {}

  [[nodiscard]] const std::vector<GridInfo>& grids() const override { return whole_.grids(); }
  [[nodiscard]] const std::vector<Metadata>& metadata() const override { return whole_.metadata(); }
  [[nodiscard]] const std::string& format() const override { return whole_.format(); }
  [[nodiscard]] double reading() const override { return 1.0; }
  SourceGrid read(std::size_t grid, Portion portion, const Log& log, const std::string& log_prefix) override;
  /// Always throws: vector grids are not supported.
  std::array<SourceGrid, 3> read_vector(std::size_t grid, Portion portion, const Log& log,
                                        const std::string& log_prefix) override;

  /// Returns the extent of a frame that was made of grids from read().
  [[nodiscard]] std::optional<Proxy::Extent> extent(const VolumeFrame& frame) const;

  /// The full-resolution reader, which reuses the tree of the first grid.
  class Rest final : public Reader {
   public:
    explicit Rest(CoarseReader& coarse) : coarse_(coarse) {}
    [[nodiscard]] const std::vector<GridInfo>& grids() const override { return whole().grids(); }
    [[nodiscard]] const std::vector<Metadata>& metadata() const override { return whole().metadata(); }
    [[nodiscard]] const std::string& format() const override { return whole().format(); }
    [[nodiscard]] std::vector<std::string> remarks() const override { return whole().remarks(); }
    [[nodiscard]] double opened() const override { return whole().opened(); }
    [[nodiscard]] double reading() const override { return whole().reading(); }
    SourceGrid read(std::size_t grid, Portion portion, const Log& log, const std::string& log_prefix) override;
    std::array<SourceGrid, 3> read_vector(std::size_t grid, Portion portion, const Log& log,
                                          const std::string& log_prefix) override {
      return whole().read_vector(grid, portion, log, log_prefix);
    }

   private:
    [[nodiscard]] Reader& whole() const { return coarse_.whole_; }
    CoarseReader& coarse_;
  };

 private:
  struct Looked {
    std::string name;
    Box box;
    glm::dmat4 index_to_world;
  };

  Reader& whole_;
  std::uint64_t min_bricks_;
  Progress* progress_;
  std::optional<std::size_t> first_;  // the grid whose tree is kept
  SourceGrid first_source_;
  SourceGrid later_source_;  // source of the last grid that was read, except for the first
  std::vector<Looked> looked_;
};

}  // namespace cumulet::volume::detail
