//! Towns of our own, written as OpenDRIVE text.

/// Names of the towns [`build`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    ["Town10HD", "Town10HD_Opt"].into_iter()
}

/// The OpenDRIVE text of a generated town; `None` for a name that is not ours.
///
/// **Determinism:** the same name gives the same bytes.
#[must_use]
pub fn build(name: &str) -> Option<String> {
    names().any(|known| known == name).then(|| straight_road(name))
}

fn straight_road(name: &str) -> String {
    let lane = |id: i32| {
        format!(
            "<lane id=\"{id}\" type=\"driving\" level=\"false\">\
             <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane>"
        )
    };
    let lanes = |ids: [i32; 3]| ids.map(lane).concat();
    format!(
        "<?xml version=\"1.0\"?><OpenDRIVE><header revMajor=\"1\" revMinor=\"4\" name=\"{name}\"/>\
         <road id=\"1\" length=\"400\" junction=\"-1\" rule=\"RHT\"><planView>\
         <geometry s=\"0\" x=\"-200\" y=\"0\" hdg=\"0\" length=\"400\"><line/></geometry>\
         </planView><lanes><laneSection s=\"0\"><left>{}</left>\
         <center><lane id=\"0\" type=\"none\"/></center><right>{}</right>\
         </laneSection></lanes></road></OpenDRIVE>",
        lanes([3, 2, 1]),
        lanes([-1, -2, -3]),
    )
}
