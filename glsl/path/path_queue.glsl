// Queues of the wavefront path tracer (Laine, Karras and Aila 2013). Each kernel runs over its queue and appends each
// path to the queue of the path's next stage. A round is
//   trace_travel.comp      traverses the medium
//   trace_intersect.comp   queries the BVH
//   trace_shade.comp       shades triangles
//   trace_camera.comp      adds finished samples to their pixels and starts the next ones
// A dispatch is trace_camera.comp over all lanes of its blocks (CM_DENSE), followed by several rounds. After a round
// only the travel queue of the next round has paths.
#ifndef CM_PATH_QUEUE_GLSL
#define CM_PATH_QUEUE_GLSL

#define CM_QUEUE_TRAVEL 0u
#define CM_QUEUE_INTERSECT 1u
#define CM_QUEUE_SHADE 2u
#define CM_QUEUE_CAMERA 3u
#define CM_QUEUES 4u
#define CM_MAX_ROUNDS 64u
#define CM_QUEUE_GROUP 64u  // lanes per work group
#define CM_ROUND_LOCATION 0

#ifndef __cplusplus
struct CmQueueHead {
  uint groups;  // arguments of glDispatchComputeIndirect: work groups for `count` paths, 1, 1
  uint groups_y;
  uint groups_z;
  uint count;
};

layout(std430, binding = CM_STORAGE_QUEUES) buffer CmQueues {
  CmQueueHead cm_heads[CM_QUEUES * (CM_MAX_ROUNDS + 1u)];  // per round
  uint cm_waiting[];  // lanes: one list per queue; CM_QUEUE_TRAVEL has two, for this round and the next
};

layout(location = CM_ROUND_LOCATION) uniform uint cm_round;

uint cm_queue_list(uint queue, uint round_number) {
  return (queue == CM_QUEUE_TRAVEL ? (round_number & 1u) * CM_QUEUES : queue) * cm_lanes();
}

void cm_enqueue(uint queue, uint round_number, uint lane) {
  uint head = round_number * CM_QUEUES + queue;
  uint index = atomicAdd(cm_heads[head].count, 1u);
  if (index % CM_QUEUE_GROUP == 0u) atomicAdd(cm_heads[head].groups, 1u);
  cm_waiting[cm_queue_list(queue, round_number) + index] = lane;
}

// Index of this invocation in its queue, length of the queue, and the invocation's lane.
uint cm_queue_index() { return gl_WorkGroupID.x * CM_QUEUE_GROUP + gl_LocalInvocationIndex; }
uint cm_queue_count(uint queue) { return cm_heads[cm_round * CM_QUEUES + queue].count; }
uint cm_queue_lane(uint queue) { return cm_waiting[cm_queue_list(queue, cm_round) + cm_queue_index()]; }

// Appends the path to the queue of its next stage: in this round if that kernel is still to run, else in the next.
void cm_send_on(CmPath p, uint lane) {
  bool travels = p.stage != CM_STAGE_INTERSECT && p.stage != CM_STAGE_VERTEX && p.stage != CM_STAGE_FINISH;
  uint queue = p.stage == CM_STAGE_INTERSECT
                   ? CM_QUEUE_INTERSECT
                   : (p.stage == CM_STAGE_VERTEX ? CM_QUEUE_SHADE
                                                 : (p.stage == CM_STAGE_FINISH ? CM_QUEUE_CAMERA : CM_QUEUE_TRAVEL));
  cm_enqueue(queue, cm_round + (travels ? 1u : 0u), lane);
}
#endif

#endif
