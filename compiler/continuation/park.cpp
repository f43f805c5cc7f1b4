// Values that live from state to state, in memory instead of registers.
//
// A compiler sees a loop around a switch: whatever one state leaves for another is alive in all of it, the
// traversal included, and holds a register of every lane there. GPUs run fewer lanes for each register a lane
// takes. Kept in an array that is read and written through an index, such values take registers only in the
// states that use them. The index is always 0, which no compiler can know: it comes from the launch's width.
// (Were it ever 1, the array has two elements.)
#include <algorithm>
#include <map>

#include "continuation/machine.h"
#include "rtc/abi.h"

namespace rtc::continuation {
namespace {

bool through_pointer(const Inst& inst) {
    return inst.op == Op::OpLoad || inst.op == Op::OpStore || inst.op == Op::OpAccessChain ||
           inst.op == Op::OpInBoundsAccessChain;
}

}  // namespace

void Machine::park(Function& main, std::vector<Id> wanted) {
    wanted.insert(wanted.end(), frame_words_.begin(), frame_words_.end());
    const std::set<Id> control = {state, ret,          depth,    push,           pop,         leave,
                                  fresh, report_return, accepted, callable_depth, callable_ret};
    std::set<Id> crossing;
    for (Id id : wanted)
        if (!control.count(id)) crossing.insert(id);

    struct Place {
        uint32_t member = 0;
        Id pointer = 0;  // type
    };
    std::map<Id, Place> places;
    std::vector<uint32_t> members;
    for (const Inst& variable : variables_)
        if (crossing.count(variable.result) && variable.ops.size() == 1) {  // no initial value
            places[variable.result] = {static_cast<uint32_t>(members.size()), variable.type};
            members.push_back(p.pointee(variable.type));
        }
    if (places.empty()) return;
    std::erase_if(variables_, [&](const Inst& variable) { return places.count(variable.result) != 0; });

    const Id u32 = p.uint_type();
    const Id type = p.add_global(Inst(Op::OpTypeStruct, 0, 0, {members.begin(), members.end()}));
    const Id parked = new_variable(p.array_type(type, 2), "rtc_parked");
    const Id zero = u32_variable("rtc_zero");
    for (Block& block : main.blocks) {
        std::vector<Inst> insts;
        insts.reserve(block.insts.size());
        for (Inst& inst : block.insts) {
            std::vector<Id> used;
            inst.for_each_id([&](Id id) {
                if (places.count(id) && std::find(used.begin(), used.end(), id) == used.end()) used.push_back(id);
            });
            std::vector<Inst> after;
            for (Id id : used) {
                const Place& place = places.at(id);
                Emitter e(p, insts);
                const Id at = e.value(Op::OpAccessChain, place.pointer,
                                      {parked, e.load(u32, zero), p.constant_u32(place.member)});
                Id stand_in = at;
                if (!through_pointer(inst)) {  // an argument must be a variable
                    const Id type = p.pointee(place.pointer);
                    stand_in = new_variable(type, "rtc_argument");
                    e.store(stand_in, e.load(type, at));
                    Emitter back(p, after);
                    back.store(at, back.load(type, stand_in));
                }
                inst.for_each_id([&](Id& operand) {
                    if (operand == id) operand = stand_in;
                });
            }
            insts.push_back(std::move(inst));
            insts.insert(insts.end(), after.begin(), after.end());
        }
        block.insts = std::move(insts);
    }
    std::vector<Inst> first;
    Emitter e(p, first);
    const Id width = e.load(u32, e.chain(spv::StorageClass::Uniform, u32, reserved.at(RTC_BINDING_PARAMS),
                                         {p.constant_u32(0), p.constant_u32(RTC_PARAM_WIDTH / 4),
                                          p.constant_u32(RTC_PARAM_WIDTH % 4)}));
    e.store(zero, e.value(Op::OpShiftRightLogical, u32, {width, p.constant_u32(31)}));
    main.blocks.front().insts.insert(main.blocks.front().insts.begin(), first.begin(), first.end());
}

}  // namespace rtc::continuation
