#pragma once

// Voxels that a host has in GL, on their way to main memory, or to where they stay in GL.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gl/programs.hpp"
#include "render/brick_kernels.hpp"
#include "render/brick_products.hpp"
#include "render/device_memories.hpp"
#include "render/upload.hpp"
#include "scene/state_in_gl.hpp"
#include "volume/state.hpp"

namespace cumulet::render {

/// One component of a GL_TEXTURE_3D.
struct VoxelTexture {
  GLuint name = 0;
  int component = 0;
};

/// Numbers in a buffer.
struct VoxelBuffer {
  GLuint name = 0;
  VoxelFormat format = VoxelFormat::floats;
  std::uint64_t offset = 0;                   ///< bytes to voxel 0
  std::array<std::uint64_t, 3> strides = {};  ///< bytes along x, y and z; zeros: without gaps, x fastest
  glm::ivec3 size{0};
};

struct GlVoxels {
  volume::Channel channel;
  std::variant<VoxelTexture, VoxelBuffer> source;
  glm::dmat4 index_to_world{1.0};
};

/// Both ends inclusive.
struct VoxelBox {
  glm::ivec3 min{0};
  glm::ivec3 max{0};
};

struct GlState {
  std::string name;  ///< begins every message
  std::vector<GlVoxels> fields;
  std::optional<std::vector<VoxelBox>> changed;  ///< none: all of it
  GLsync wait = nullptr;                         ///< that the device waits for first
};

/// Copies bricks that are not empty on the device at once, and takes them to main memory when they are there. Never
/// waits. All calls but those that tell need the context current and a StateGuard around.
class VoxelTransfers {
 public:
  /// memories: where those go that stay in GL.
  VoxelTransfers(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, DeviceMemoriesPtr memories);

  /// Given the fields, whose copies are bricks; of those that changed the empty ones, too, as zeros.
  using Arrive = std::function<void(std::vector<volume::FieldCopy> fields)>;
  /// Fields stay in GL.
  struct StayInGl {
    /// Given those that arrived, in their order: the state that they make, what was made of another that it goes on
    /// with among it; none: there is none in GL to go on with. Of those that changed bricks are not tidy.
    std::function<std::optional<scene::StateInGl>(const std::vector<scene::StateInGl::Field>& fields)> join;
    /// By which settings it is to be found what that gives off.
    std::function<std::vector<scene::Emission>()> wanted;
    /// The same with these, and no others. False: what it goes on with is another by now; it is joined again.
    std::function<bool(scene::StateInGl state)> arrive;
    /// What changed comes to main memory, as what it goes on with did; null: nothing does.
    Arrive instead;
    volume::ValuesWantedPtr values_wanted;  ///< of its bricks; null: nobody asks
  };
  using Arrival = std::variant<Arrive, StayInGl>;
  /// A whole state does not arrive: something is wrong with it. Those on top of it that were on their way are gone.
  using Refuse = std::function<void()>;
  /// whose: of one the oldest whole state that is on its way arrives, and of those behind it the newest. Fields'
  /// channels and transforms are checked. Throws Error(invalid_argument) for what is no such object, Error(unsupported)
  /// beyond the driver's limits, and what GL's allocations throw; then all is as it was.
  void begin(const GlState& state, const void* whose, Arrival arrival, Refuse refuse);
  /// What stays in GL comes to main memory after all: as a whole state, after those that are on their way, of what find
  /// gives by then; null: it does not come. channels: what it has.
  using Find = std::function<scene::StateInGlPtr()>;
  void bring_back(const void* whose, const std::vector<volume::Channel>& channels, Find find, Arrive arrive,
                  Refuse refuse);
  /// Once those that are on their way are there: what else is wanted is made of the state that stay.join gives for
  /// none. It does not arrive if that is nothing.
  void make_products(const void* whose, std::string name, StayInGl stay);
  /// Of whose newest whole state that is on its way.
  struct Announced {
    std::vector<volume::Channel> channels;
    bool stays_in_gl = false;
    glm::dmat4 index_to_world{1.0};  ///< of the first of them
  };
  /// None: there is none.
  [[nodiscard]] std::optional<Announced> announced(const void* whose) const;
  /// Whether any is on its way.
  [[nodiscard]] bool busy() const { return !transfers_.empty(); }
  /// Takes what is there, until about the deadline. Throws what arrivals throw, and Error(file) for voxels that are not
  /// finite: that state is dropped, of a whole one what is on top of it as well, and the next call goes on.
  void follow(Deadline deadline);
  /// In GL.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // An object of the host's, looked at.
  struct Source {
    GLuint texture = 0;
    int component = 0;
    GLuint buffer = 0;
    std::uint64_t offset = 0;
    glm::u64vec3 strides{0};
    glm::ivec3 size{0};
    VoxelFormat format = VoxelFormat::floats;
  };
  // Where so many bricks go, empty ones among them.
  struct Room {
    std::size_t bricks = 0;
    std::size_t bytes = 0;  // of values
    std::size_t back_bytes = 0;
    gl::Object places;
    gl::Object values;
    gl::ReadBack places_back;
    gl::ReadBack values_back;
    std::size_t expected = 0;  // as many were filled last
    std::size_t summed = 0;    // bricks that there is room for below
    gl::Object summaries;
    gl::ReadBack summaries_back;

    [[nodiscard]] std::uint64_t all_bytes() const {
      return 2 * places_bytes(bricks) + bytes + back_bytes + 2 * summed * sizeof(volume::BrickSummary);
    }
  };
  static std::size_t places_bytes(std::size_t bricks) { return (2 + bricks) * sizeof(std::uint32_t); }
  // Layers of bricks of a field's, which one dispatch packs.
  struct Piece {
    std::size_t field = 0;
    std::uint32_t first = 0;  // brick, or of those that were chosen
    std::uint32_t count = 0;
    glm::ivec2 layers{0};  // from, to
    Room room;
    std::size_t copied = 0;                      // bricks that were copied back before their number was known
    std::size_t taken = 0;                       // filled and emptied ones
    std::shared_ptr<volume::DeviceMemory> kept;  // that stay in GL; null: there are none
    std::uint32_t filled = 0;                    // of those
    std::uint32_t summarized = 0;                // of those
  };
  // What stayed in GL, on its way back.
  struct Return {
    Find find;
    scene::StateInGlPtr state;                        // once it is known
    std::vector<std::vector<gl::ReadBack>> memories;  // of each field
    std::size_t field = 0;
    std::size_t taken = 0;  // of that
  };
  // A state that stays, while is made of it what is wanted.
  struct Staying {
    std::vector<scene::StateInGl::Field> fields;  // that arrived
    std::optional<scene::StateInGl> state;
    std::vector<scene::ProductInGl> kept;  // as they are
    std::deque<BrickProducts> making;
    std::exception_ptr failure;  // of that; main memory has other ways
  };
  struct Transfer {
    const void* whose = nullptr;
    bool whole = true;
    std::string name;
    std::vector<Source> sources;
    std::vector<Piece> pieces;
    std::vector<volume::FieldCopy> fields;
    bool finite = true;
    Arrival arrival;
    Refuse refuse;
    gl::Fence fence;
    bool counted = false;   // what is filled is known, and was copied
    gl::Object brick_tree;  // while it is summarized
    std::optional<Return> back;
    std::optional<Staying> staying;  // once its fields are there

    [[nodiscard]] bool stays_in_gl() const { return std::holds_alternative<StayInGl>(arrival); }
    // Nothing but what is made of a state.
    [[nodiscard]] bool makes() const { return sources.empty() && !back; }
  };

  // Which bricks of it were packed, and where to.
  class PackedPlaces;
  static PackedPlaces places_of(const Transfer& transfer, const Piece& piece);

  [[nodiscard]] Source open(const GlVoxels& field, const std::string& what) const;
  [[nodiscard]] Source open_texture(const VoxelTexture& texture, const std::string& what) const;
  [[nodiscard]] Source open_buffer(const VoxelBuffer& buffer, const std::string& what) const;
  // Of a buffer the bytes of these layers of bricks: from, to.
  [[nodiscard]] glm::u64vec2 range_of(const Source& source, glm::ivec2 layers) const;
  // chosen: null: all bricks.
  void plan(Transfer& transfer, std::size_t field, const std::vector<std::uint32_t>* chosen,
            const std::string& what) const;
  [[nodiscard]] Room take_room(std::size_t bricks, std::size_t bytes);
  void make_room_back(Room& room, std::size_t bytes) const;
  void pack(const Transfer& transfer, const Piece& piece, GLuint chosen);
  [[nodiscard]] gl::Fence fence() const;
  // Returns whether all of it was taken.
  bool take(Transfer& transfer, Deadline deadline);
  // Of what was in GL.
  bool take_back(Transfer& transfer, Deadline deadline);
  // Of what stays there.
  bool take_in_gl(Transfer& transfer, Deadline deadline);
  void join(Transfer& transfer, std::vector<scene::StateInGl::Field> fields);
  // With all that was made of it.
  static scene::StateInGl made(Staying& staying);
  // Returns whether it did, or never will; else it was joined again.
  bool arrive_in_gl(Transfer& transfer);
  // What the driver had not copied by guess.
  void copy_rest(Transfer& transfer) const;
  // Of what stays in GL: values where they stay, and what main memory is to know of them. Returns whether all is sent.
  bool summarize(Transfer& transfer, Deadline deadline);
  void begin_summaries(Transfer& transfer);
  void summarize(const Transfer& transfer, const Piece& piece, std::uint32_t first, std::uint32_t end) const;
  [[nodiscard]] BrickSummaries summaries_of(const Transfer& transfer, const Piece& piece) const;
  static std::vector<scene::StateInGl::Field> take_fields(Transfer& transfer);
  void recycle(Transfer& transfer);
  using Transfers = std::deque<Transfer>;
  // Nobody waits for it any more. Returns the one after it.
  Transfers::iterator drop(const Transfers::iterator& transfer);
  // Those that came after a whole one, which is refused.
  void refuse_on_top(const Transfer& whole);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  DeviceMemoriesPtr memories_;
  std::uint64_t most_bytes_;
  std::uint64_t alignment_;
  gl::Object sampler_;
  std::optional<light::BlackBody> body_;  // once anything glows; made in a millisecond
  Transfers transfers_;                   // in the order in which they were begun
  std::deque<Room> spare_;
  std::size_t most_pieces_ = 0;  // of a state, lately
  int idle_ = 0;                 // calls of follow() since there was any
};

}  // namespace cumulet::render
