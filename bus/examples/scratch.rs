#![allow(warnings)]
use std::time::{Duration, Instant};
use zenoh::{Config, Session, Wait};
fn cfg(mode: &str, listen: &[u16], connect: &[u16], extra: &[(&str, &str)]) -> Config {
    let eps = |p: &[u16]| {
        format!(
            "[{}]",
            p.iter().map(|p| format!("\"tcp/127.0.0.1:{p}\"")).collect::<Vec<_>>().join(",")
        )
    };
    let mut c = Config::default();
    for (k, v) in [
        ("mode", format!("\"{mode}\"")),
        ("listen/endpoints", eps(listen)),
        ("connect/endpoints", eps(connect)),
        ("connect/timeout_ms", "-1".into()),
        ("connect/exit_on_failure", "true".into()),
        (
            "connect/retry",
            "{period_init_ms: 10, period_max_ms: 500, period_increase_factor: 1.5}".into(),
        ),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
        ("transport/link/tx/lease", "2000".into()),
    ] {
        c.insert_json5(k, &v).unwrap();
    }
    for (k, v) in extra {
        c.insert_json5(k, v).unwrap();
    }
    c
}
async fn ask(s: &Session, key: &str) -> String {
    let t = Instant::now();
    let r = s.get(key).timeout(Duration::from_secs(3)).await.unwrap();
    let mut out = String::new();
    while let Ok(x) = r.recv_async().await {
        match x.result() {
            Ok(v) => out += &format!("ok({}) ", v.payload().try_to_string().unwrap()),
            Err(e) => out += &format!("err({:?}) ", e.payload().try_to_string()),
        }
    }
    format!("{out} {:?}", t.elapsed())
}
#[tokio::main]
async fn main() {
    let fast: &[(&str, &str)] =
        &[("scouting/delay", "0"), ("open/return_conditions/connect_scouted", "false")];
    let mut port = 17500u16;
    for (wmode, cmode, extra) in [
        ("router", "peer", &[][..]),
        ("router", "peer", fast),
        ("router", "client", fast),
        ("peer", "peer", fast),
        ("peer", "client", fast),
    ] {
        for fastdecl in [true] {
            port += 1;
            let t = Instant::now();
            let w = zenoh::open(cfg(wmode, &[port], &[], extra)).await.unwrap();
            let tw = t.elapsed();
            let _q = w
                .declare_queryable("w")
                .complete(true)
                .callback(|q| {
                    q.reply(q.key_expr(), "w").express(true).wait().unwrap();
                })
                .await
                .unwrap();
            let t = Instant::now();
            let a = zenoh::open(cfg(cmode, &[], &[port], extra)).await.unwrap();
            let ta = t.elapsed();
            println!(
                "== world {wmode}, others {cmode}, extra {}: open w {tw:?} a {ta:?}",
                extra.len()
            );
            println!("a→w first: {}", ask(&a, "w").await);
            let _qa = a
                .declare_queryable("a")
                .complete(true)
                .callback(|q| {
                    q.reply(q.key_expr(), "a").wait().unwrap();
                })
                .await
                .unwrap();
            println!("w→a at once: {}", ask(&w, "a").await);
            let b = zenoh::open(cfg(cmode, &[], &[port], extra)).await.unwrap();
            println!("b→a first: {}", ask(&b, "a").await);
            println!("b→none: {}", ask(&b, "none").await);
            println!("w→none: {}", ask(&w, "none").await);
            tokio::time::sleep(Duration::from_millis(200)).await;
            println!("w→a later: {}", ask(&w, "a").await);
            println!("b→a later: {}", ask(&b, "a").await);
            let d = zenoh::open({
                let mut c = Config::default();
                c.insert_json5("mode", "\"client\"").unwrap();
                c.insert_json5("connect/endpoints", &format!("[\"tcp/127.0.0.1:{port}\"]"))
                    .unwrap();
                c
            })
            .await
            .unwrap();
            println!("default client→w,a: {} {}", ask(&d, "w").await, ask(&d, "a").await);
            let d2 = zenoh::open({
                let mut c = Config::default();
                c.insert_json5("connect/endpoints", &format!("[\"tcp/127.0.0.1:{port}\"]"))
                    .unwrap();
                c
            })
            .await
            .unwrap();
            println!("default peer→w,a: {} {}", ask(&d2, "w").await, ask(&d2, "a").await);
        }
    }
    // via a router
    for (wmode, cmode) in
        [("peer", "peer"), ("client", "client"), ("router", "peer"), ("peer", "client")]
    {
        port += 1;
        let r = zenoh::open(cfg("router", &[port], &[], fast)).await.unwrap();
        let w = zenoh::open(cfg(wmode, &[], &[port], fast)).await.unwrap();
        let _q = w
            .declare_queryable("w")
            .complete(true)
            .callback(|q| {
                q.reply(q.key_expr(), "w").wait().unwrap();
            })
            .await
            .unwrap();
        let a = zenoh::open(cfg(cmode, &[], &[port], fast)).await.unwrap();
        println!("== via router: world {wmode}, others {cmode}");
        println!("a→w first: {}", ask(&a, "w").await);
        let _qa = a
            .declare_queryable("a")
            .complete(true)
            .callback(|q| {
                q.reply(q.key_expr(), "a").wait().unwrap();
            })
            .await
            .unwrap();
        println!("w→a at once: {}", ask(&w, "a").await);
        tokio::time::sleep(Duration::from_millis(200)).await;
        println!("w→a later: {}", ask(&w, "a").await);
        println!("a→w later: {}", ask(&a, "w").await);
        println!("a→none: {}", ask(&a, "none").await);
    }
    std::process::exit(0);
}
