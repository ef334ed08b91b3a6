#include "base/error.hpp"

#include <exception>
#include <new>

namespace cumulet {

Error caught(const std::string& what) {
  try {
    throw;
  } catch (const Error& error) {
    return error;
  } catch (const std::bad_alloc&) {
    return {ErrorCode::out_of_memory, what + ": out of memory"};
  } catch (const std::exception& error) {
    return {ErrorCode::internal, std::string("internal error: ") + error.what()};
  }
}

}  // namespace cumulet
