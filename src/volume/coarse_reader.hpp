#pragma once

// Private to volume/: a file's grids as they look from afar.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "volume/import_detail.hpp"
#include "volume/stand_in.hpp"

namespace cumulet::volume::detail {

/// Reads of each grid of numbers what StandIn says, and keeps the tree of the first for the reader of the whole.
class CoarseReader final : public Reader {
 public:
  /// Of a reader that streams. read() throws for a first grid that has fewer bricks.
  CoarseReader(Reader& whole, std::uint64_t least_bricks, Progress* progress)
      : whole_(whole), least_bricks_(least_bricks), progress_(progress) {}

  [[nodiscard]] const std::vector<GridInfo>& grids() const override { return whole_.grids(); }
  [[nodiscard]] const std::vector<Metadata>& metadata() const override { return whole_.metadata(); }
  [[nodiscard]] const std::string& format() const override { return whole_.format(); }
  [[nodiscard]] double reading() const override { return 1.0; }
  SourceGrid read(std::size_t grid, Portion portion, const Log& log, const std::string& log_prefix) override;
  /// There are none.
  std::array<SourceGrid, 3> read_vector(std::size_t grid, Portion portion, const Log& log,
                                        const std::string& log_prefix) override;

  /// Of the frame that was made of what read() gave.
  [[nodiscard]] std::optional<StandIn::Extent> extent(const VolumeFrame& frame) const;

  /// The whole's own, which need not read the first grid's tree again.
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
  std::uint64_t least_bricks_;
  Progress* progress_;
  std::optional<std::size_t> first_;  // the grid that is kept
  SourceGrid first_source_;
  SourceGrid later_source_;  // what the last that was read is of
  std::vector<Looked> looked_;
};

}  // namespace cumulet::volume::detail
